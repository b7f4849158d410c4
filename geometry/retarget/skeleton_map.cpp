// SPDX-License-Identifier: MIT
#include "geometry/retarget/skeleton_map.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/retarget/skeleton_tables.h"

namespace holdfast {
namespace {

constexpr std::string_view kRequired[] = {
    "pelvis",      "left_hip",    "right_hip",     "left_knee",      "right_knee",
    "left_ankle",  "right_ankle", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist",  "right_wrist"};

// Joint by name, the first if several have it.
using JointsByName = std::unordered_map<std::string, int>;

bool IsDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == text.npos;
}

// If nearly every name ends in "_12", some program added that number.
bool NamesAreNumbered(const SourceMotion& motion) {
  std::size_t numbered = 0;
  for (const std::string& name : motion.joint_names) {
    const std::size_t bar = name.rfind('_');
    if (bar != name.npos && IsDigits(std::string_view(name).substr(bar + 1))) ++numbered;
  }
  return motion.joint_names.size() >= 13 && 10 * numbered >= 9 * motion.joint_names.size();
}

// Common prefix of nearly every name, up to a separator ("Character1_"); empty if there is none.
std::string_view CommonPrefix(const SourceMotion& motion) {
  const auto& names = motion.joint_names;
  if (names.empty()) return {};
  const std::string_view name = names[names.size() / 2];
  for (std::size_t end = name.size(); end > 0; --end) {
    if (std::string_view("_-. ").find(name[end - 1]) == std::string_view::npos) continue;
    const std::string_view prefix = name.substr(0, end);
    const auto count =
        std::ranges::count_if(names, [&](const auto& other) { return other.starts_with(prefix); });
    if (10 * static_cast<std::size_t>(count) >= 9 * names.size()) return prefix;
  }
  return {};
}

JointsByName NamesOf(const SourceMotion& motion, std::string_view prefix) {
  const bool numbered = NamesAreNumbered(motion);
  JointsByName joints;
  for (int j = 0; j < motion.NumJoints(); ++j) {
    std::string_view name = motion.joint_names[static_cast<std::size_t>(j)];
    if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
    const std::size_t bar = name.rfind('_');
    if (numbered && bar != name.npos && IsDigits(name.substr(bar + 1))) name = name.substr(0, bar);
    joints.try_emplace(SkeletonKey(name), j);
  }
  return joints;
}

// Calls `use` with each of the texts between bars, until it returns true.
template <typename Use>
void ForEachOf(std::string_view texts, const Use& use) {
  while (true) {
    const std::size_t bar = std::min(texts.find('|'), texts.size());
    if (use(texts.substr(0, bar)) || bar == texts.size()) return;
    texts.remove_prefix(bar + 1);
  }
}

int FindSource(const JointsByName& joints, std::string_view patterns, std::string_view side,
               std::string_view prefix) {
  int found = -1;
  ForEachOf(patterns, [&](std::string_view pattern) {
    const auto joint = joints.find(SkeletonKey(prefix) + SkeletonKey(SideName(pattern, side)));
    if (joint != joints.end()) found = joint->second;
    return found >= 0;
  });
  return found;
}

SkeletonMap Apply(const SkeletonTable& table, std::string_view prefix, const JointsByName& joints) {
  SkeletonMap map;
  map.name = table.name;
  map.source.fill(-1);
  map.lumbar_lean = table.lumbar_lean;
  for (const auto& [target, sources] : table.rows) {
    map.source[*FindJoint(SideName(target, "left"))] =
        FindSource(joints, sources, table.left, prefix);
    if (target.starts_with('*')) {
      map.source[*FindJoint(SideName(target, "right"))] =
          FindSource(joints, sources, table.right, prefix);
    }
  }
  for (std::size_t k = 0; k < table.fingers.size(); ++k) {
    map.source[kLeftHandBegin + k] = FindSource(joints, table.fingers[k], table.left, prefix);
    map.source[kRightHandBegin + k] = FindSource(joints, table.fingers[k], table.right, prefix);
  }
  return map;
}

std::vector<std::string_view> MissingLimbs(const SkeletonMap& map) {
  std::vector<std::string_view> missing;
  for (const std::string_view name : kRequired) {
    if (map.source[*FindJoint(name)] < 0) missing.push_back(name);
  }
  return missing;
}

constexpr std::string_view kMapRemedy =
    "Write a map and give it with --map map.json: "
    R"({"HipJoint": "pelvis", "LThigh": "left_hip", ...}, source joint to SMPL-X joint)";

// An ancestor must map to an ancestor: detects swapped sides and crossed limbs.
void CheckTree(const SkeletonMap& map, const SourceMotion& motion, const std::string& where) {
  for (int j = 1; j < kNumJoints; ++j) {
    if (map.source[j] < 0) continue;
    int above = kJointParents[j];
    while (above >= 0 && map.source[above] < 0) above = kJointParents[above];
    // The pelvis and its children may be siblings of the spine (a root above both).
    if (above <= 0) continue;
    int s = motion.parents[map.source[j]];
    while (s >= 0 && s != map.source[above]) s = motion.parents[s];
    if (s < 0) {
      throw Error(where,
                  fmt::format("'{}' is mapped to {} but is not below '{}', which is mapped to {}",
                              motion.joint_names[map.source[j]], kJointNames[j],
                              motion.joint_names[map.source[above]], kJointNames[above]),
                  kMapRemedy);
    }
  }
}

// Map from VRM's extension, if it names all limbs.
std::optional<SkeletonMap> HumanoidMap(const SourceMotion& motion) {
  JointsByName joints;
  for (const auto& [bone, joint] : motion.humanoid) joints.try_emplace(SkeletonKey(bone), joint);
  std::optional<SkeletonMap> best;
  for (const SkeletonTable& table : SkeletonTables()) {
    if (std::ranges::find(kHumanoidTables, table.name) == std::end(kHumanoidTables)) continue;
    SkeletonMap map = Apply(table, "", joints);
    if (!MissingLimbs(map).empty() || (best && map.NumMapped() <= best->NumMapped())) continue;
    best = std::move(map);
    best->name = "VRM humanoid";
  }
  return best;
}

}  // namespace

int SkeletonMap::NumMapped() const {
  return static_cast<int>(std::ranges::count_if(source, [](int s) { return s >= 0; }));
}

std::vector<std::string> SkeletonMap::UnusedSourceJoints(const SourceMotion& motion) const {
  std::vector<std::string> unused;
  for (int j = 0; j < motion.NumJoints(); ++j) {
    if (std::ranges::count(source, j) == 0) unused.push_back(motion.joint_names[j]);
  }
  return unused;
}

SkeletonMap RecognizeSkeleton(const SourceMotion& motion, const std::string& where) {
  if (const auto humanoid = HumanoidMap(motion)) {
    CheckTree(*humanoid, motion, where);
    return *humanoid;
  }
  const std::string_view common = CommonPrefix(motion);
  std::vector<JointsByName> namings = {NamesOf(motion, "")};
  if (!common.empty()) namings.push_back(NamesOf(motion, common));
  std::optional<SkeletonMap> best;
  std::size_t best_missing = 0;
  int best_score = 0;
  const auto consider = [&](const SkeletonTable& table, std::string_view prefix,
                            const JointsByName& joints) {
    SkeletonMap map = Apply(table, prefix, joints);
    const std::size_t missing = MissingLimbs(map).size();
    int score = map.NumMapped();
    for (const std::string_view mark : table.marks) {
      if (FindSource(joints, mark, "", prefix) >= 0) score += 2;
    }
    if (!best || missing < best_missing || (missing == best_missing && score > best_score)) {
      best = std::move(map);
      best_missing = missing;
      best_score = score;
    }
  };
  for (const JointsByName& joints : namings) {
    for (const SkeletonTable& table : SkeletonTables()) {
      consider(table, "", joints);
      if (table.prefixes.empty()) continue;
      ForEachOf(table.prefixes, [&](std::string_view prefix) {
        consider(table, prefix, joints);
        return false;
      });
    }
  }
  if (best_missing > 0) {
    throw Error(where,
                fmt::format("the joint names are unknown: the closest known skeleton is '{}', but "
                            "it finds no {}; the joints here are {}",
                            best->name, fmt::join(MissingLimbs(*best), ", "),
                            fmt::join(motion.joint_names, ", ")),
                kMapRemedy);
  }
  CheckTree(*best, motion, where);
  return *best;
}

SkeletonMap ReadSkeletonMap(const std::filesystem::path& path, const SourceMotion& motion) {
  const std::string where = path.string();
  const nlohmann::json json =
      nlohmann::json::parse(ReadFile(path, std::size_t{1} << 20), nullptr, false, true);
  if (!json.is_object()) throw Error(where, "not a JSON object", kMapRemedy);
  SkeletonMap map;
  map.name = path.filename().string();
  map.source.fill(-1);
  for (const auto& [source_name, target_name] : json.items()) {
    if (!target_name.is_string()) {
      throw Error(where, fmt::format("'{}' is not mapped to a name", source_name), kMapRemedy);
    }
    const auto target = FindJoint(target_name.get_ref<const std::string&>());
    if (!target) {
      throw Error(where,
                  fmt::format("'{}' is not a joint of SMPL-X", target_name.get<std::string>()),
                  fmt::format("Use one of {}", fmt::join(kJointNames, ", ")));
    }
    const auto found = std::find(motion.joint_names.begin(), motion.joint_names.end(), source_name);
    if (found == motion.joint_names.end()) {
      throw Error(where, fmt::format("the motion has no joint '{}'", source_name),
                  fmt::format("Use its own names: {}", fmt::join(motion.joint_names, ", ")));
    }
    int& source = map.source[*target];
    if (source >= 0) {
      throw Error(where, fmt::format("two joints are mapped to {}", kJointNames[*target]),
                  "Keep one of them");
    }
    source = static_cast<int>(found - motion.joint_names.begin());
  }
  const auto missing = MissingLimbs(map);
  if (!missing.empty()) {
    throw Error(where, fmt::format("no source joint for {}", fmt::join(missing, ", ")), kMapRemedy);
  }
  CheckTree(map, motion, where);
  return map;
}

std::vector<std::string> KnownSkeletons() {
  std::vector<std::string> names;
  for (const SkeletonTable& table : SkeletonTables()) names.emplace_back(table.name);
  return names;
}

}  // namespace holdfast
