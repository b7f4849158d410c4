// SPDX-License-Identifier: MIT
#include "geometry/import/archive_kind.h"

#include <algorithm>
#include <initializer_list>

#include <fmt/format.h>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/zip_archive.h"

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
  // The last length of an array's shape; 0 when it cannot be read.
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
  // A clip with members missing is still meant as one.
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
        fmt::format("a zip archive (.npz or other) that does not open: {}", identity.fault);
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

}  // namespace holdfast
