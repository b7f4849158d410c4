// SPDX-License-Identifier: MIT
#include "geometry/import/content_kind.h"

#include <algorithm>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/import/file_kind.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/zip_archive.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxListed = 10'000;

std::vector<std::string> Members(const std::filesystem::path& path, std::string& fault) {
  std::vector<std::string> names;
  try {
    const ZipArchive archive{ByteSource(path)};
    for (const ZipMember& member : archive.Members()) {
      if (names.size() < kMaxListed) names.emplace_back(member.name);
    }
  } catch (const Error& error) {
    fault = error.Problem();
  }
  return names;
}

FileKind NpzKind(const std::filesystem::path& path, const std::vector<std::string>& members,
                 std::string& detail) {
  const auto has = [&](std::initializer_list<const char*> keys) {
    return std::ranges::all_of(keys, [&](const char* key) {
      return std::ranges::find(members, fmt::format("{}.npy", key)) != members.end();
    });
  };
  // Last dimension of an array; 0 if the array cannot be read.
  const auto columns = [&](const char* key) -> std::size_t {
    try {
      const NpyMember member = NpzReader(path).Read(key);
      return member.array.shape.empty() ? 0 : member.array.shape.back();
    } catch (const Error& error) {
      detail = error.Problem();
      return 0;
    }
  };
  if (has({"v_template", "kintree_table"}) || has({"v_template", "weights", "J_regressor"})) {
    return FileKind::kBodyModel;
  }
  if (has({"root_orient", "pose_body"})) return FileKind::kClip;
  if (has({"body", "object", "rhand"}) || has({"motion_intent", "obj_name"})) {
    return FileKind::kGrab;
  }
  if (has({"poses"})) {
    const std::size_t width = columns("poses");
    if (width == 3 * kNumJoints) return FileKind::kClip;
    if (width == 156) return FileKind::kSmplhMotion;
    if (width == 72) return FileKind::kSmplMotion;
  }
  if (has({"body_pose"}) || has({"fullpose"}) || has({"global_orient", "transl"})) {
    return FileKind::kParameters;
  }
  // A clip with missing members is still meant as a clip.
  if (has({"trans", "pose_body"}) || has({"trans", "root_orient"}) ||
      has({"mocap_frame_rate", "trans"})) {
    return FileKind::kClip;
  }
  return FileKind::kNpz;
}

}  // namespace

void IdentifyArchive(const std::filesystem::path& path, Identity& identity) {
  identity.members = Members(path, identity.fault);
  if (!identity.fault.empty()) {
    identity.kind = FileKind::kDamagedArchive;
    identity.fault =
        fmt::format("a zip archive (.npz or other) that cannot be opened: {}", identity.fault);
    return;
  }
  const auto any = [&](std::string_view end) {
    return std::ranges::any_of(identity.members,
                               [&](const std::string& name) { return name.ends_with(end); });
  };
  if (any(".npy")) {
    identity.kind = NpzKind(path, identity.members, identity.detail);
  } else if (any("data.pkl")) {
    identity.kind = FileKind::kTorch;
  } else if (any(".usdc") || any(".usda")) {
    identity.kind = FileKind::kUsd;
  } else {
    identity.kind = FileKind::kZip;
  }
}

namespace {

constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 200;
constexpr std::size_t kShownKeys = 8;

constexpr std::pair<FileKind, std::string_view> kDescriptions[] = {
    {FileKind::kMissing, "no such file"},
    {FileKind::kFolder, "folder"},
    {FileKind::kResultFolder, "result folder of Holdfast"},
    {FileKind::kSpecial, "not a regular file"},
    {FileKind::kUnreadable, "file that cannot be read"},
    {FileKind::kEmpty, "empty file"},
    {FileKind::kDamagedArchive, "damaged archive"},
    {FileKind::kClip, "SMPL-X motion (.npz)"},
    {FileKind::kSmplhMotion, "SMPL-H motion, as in AMASS (.npz)"},
    {FileKind::kSmplMotion, "SMPL motion (.npz)"},
    {FileKind::kParameters, "SMPL-X parameters in smplx's names (.npz)"},
    {FileKind::kGrab, "GRAB sequence (.npz)"},
    {FileKind::kBodyModel, "body model (.npz)"},
    {FileKind::kNpz, "numpy archive (.npz)"},
    {FileKind::kNpy, "numpy array (.npy)"},
    {FileKind::kPickle, "Python pickle"},
    {FileKind::kTorch, "torch archive"},
    {FileKind::kSafetensors, "network weights (safetensors)"},
    {FileKind::kZip, "zip archive"},
    {FileKind::kBvh, "motion: BVH"},
    {FileKind::kAmc, "motion: Acclaim (.amc)"},
    {FileKind::kAsf, "skeleton: Acclaim (.asf)"},
    {FileKind::kMarkers, "marker recording"},
    {FileKind::kFbx, "FBX scene"},
    {FileKind::kObj, "mesh: Wavefront (.obj)"},
    {FileKind::kPly, "mesh: .ply"},
    {FileKind::kPlyPoints, "point cloud: .ply"},
    {FileKind::kStl, "mesh: .stl"},
    {FileKind::kOff, "mesh: .off"},
    {FileKind::kGlb, "scene: glTF binary (.glb)"},
    {FileKind::kGltf, "scene: glTF (.gltf)"},
    {FileKind::kUsd, "scene: USD"},
    {FileKind::kMetrics, "Holdfast's metrics (JSON)"},
    {FileKind::kSkeletonMap, "skeleton map for import (JSON)"},
    {FileKind::kJson, "JSON"},
    {FileKind::kHtml, "web page (HTML)"},
    {FileKind::kGitLfsPointer, "Git LFS pointer"},
    {FileKind::kHdf5, "HDF5"},
    {FileKind::kMatlab, "MATLAB data"},
    {FileKind::kPicture, "picture"},
    {FileKind::kVideo, "video"},
    {FileKind::kText, "text"},
};

// Nesting depth of brackets. A recursive parser must not get input that nests too deep.
int Depth(const std::string& text) {
  int depth = 0, deepest = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == '{' || c == '[') {
      deepest = std::max(deepest, ++depth);
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return deepest;
}

bool IsSkeletonMap(const nlohmann::json& json) {
  if (json.empty()) return false;
  std::size_t joints = 0;
  for (const auto& value : json) {
    if (!value.is_string()) return false;
    joints += FindJoint(value.get<std::string>()).has_value();
  }
  return 2 * joints >= json.size();
}

}  // namespace

void IdentifyJson(const std::filesystem::path& path, Identity& identity) {
  identity.kind = FileKind::kJson;
  std::string text;
  try {
    text = ReadGzipText(path, kMaxJsonBytes);
  } catch (const Error& error) {
    identity.fault = error.Problem();
    return;
  }
  if (Depth(text) > kMaxDepth) {
    identity.fault = "begins like JSON, but is nested too deeply";
    return;
  }
  if (IsJsonLines(text)) {
    identity.detail = "JSON lines";
    return;
  }
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) {
    identity.fault = "begins like JSON, but is not valid JSON (cut off?)";
    return;
  }
  if (!json.is_object()) return;
  const auto schema = json.find("schema");
  if (schema != json.end() && schema->is_string() &&
      schema->get<std::string>().starts_with("holdfast/")) {
    identity.kind = FileKind::kMetrics;
    identity.detail = schema->get<std::string>();
    return;
  }
  if (json.contains("asset") && (json.contains("nodes") || json.contains("meshes"))) {
    identity.kind = FileKind::kGltf;
    return;
  }
  if (IsSkeletonMap(json)) {
    identity.kind = FileKind::kSkeletonMap;
    identity.detail = fmt::format("{} joints", json.size());
    return;
  }
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) {
    if (keys.size() < kShownKeys) keys.push_back(key);
  }
  identity.detail = fmt::format("keys: {}", fmt::join(keys, ", "));
}

std::string_view Describe(FileKind kind) {
  for (const auto& [known, text] : kDescriptions) {
    if (kind == known) return text;
  }
  return "unknown";
}

}  // namespace holdfast
