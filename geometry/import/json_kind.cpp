// SPDX-License-Identifier: MIT
#include "geometry/import/json_kind.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/io/container/gzip.h"
#include "geometry/io/pickle/json_data.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 200;
constexpr std::size_t kShownKeys = 8;

// Brackets within brackets; a parser that recurses must not be sent too deep.
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
    identity.fault = "begins like JSON, and nests too deep";
    return;
  }
  if (IsJsonLines(text)) {
    identity.detail = "JSON lines";
    return;
  }
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) {
    identity.fault = "begins like JSON, and is not (cut off?)";
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

}  // namespace holdfast
