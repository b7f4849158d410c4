// SPDX-License-Identifier: MIT
#include "geometry/skeleton_map.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/atomic_file.h"
#include "geometry/io/text_scanner.h"

namespace holdfast {
namespace {

/// One row of a table: SMPL-X joint and what sources call it. '*' stands for the side:
/// "left"/"right" on SMPL-X's part, the table's own words on the source's. '|' parts equivalent
/// names.
struct Row {
  std::string_view target;
  std::string_view sources;
};

struct Table {
  std::string_view name;
  std::string_view left, right;
  std::vector<Row> rows;
  std::vector<std::string_view> marks;  // source joints that no other table's skeletons have
  std::optional<double> lumbar_lean = std::nullopt;  // see SkeletonMap
};

const std::vector<Table>& Tables() {
  static const std::vector<Table> tables = {
      {"SMPL",
       "left",
       "right",
       {{"pelvis", "pelvis"},
        {"spine1", "spine1"},
        {"spine2", "spine2"},
        {"spine3", "spine3"},
        {"neck", "neck"},
        {"head", "head"},
        {"jaw", "jaw"},
        {"*_eye", "*_eye|*_eye_smplhf"},
        {"*_hip", "*_hip"},
        {"*_knee", "*_knee"},
        {"*_ankle", "*_ankle"},
        {"*_foot", "*_foot"},
        {"*_collar", "*_collar"},
        {"*_shoulder", "*_shoulder"},
        {"*_elbow", "*_elbow"},
        {"*_wrist", "*_wrist"},
        {"*_index1", "*_index1"},
        {"*_index2", "*_index2"},
        {"*_index3", "*_index3"},
        {"*_middle1", "*_middle1"},
        {"*_middle2", "*_middle2"},
        {"*_middle3", "*_middle3"},
        {"*_pinky1", "*_pinky1"},
        {"*_pinky2", "*_pinky2"},
        {"*_pinky3", "*_pinky3"},
        {"*_ring1", "*_ring1"},
        {"*_ring2", "*_ring2"},
        {"*_ring3", "*_ring3"},
        {"*_thumb1", "*_thumb1"},
        {"*_thumb2", "*_thumb2"},
        {"*_thumb3", "*_thumb3"}},
       {}},
      {"SMPL, short names",
       "L",
       "R",
       {{"pelvis", "pelvis"},
        {"spine1", "spine1|torso"},
        {"spine2", "spine2|spine"},
        {"spine3", "spine3|chest"},
        {"neck", "neck"},
        {"head", "head"},
        {"*_hip", "*_hip"},
        {"*_knee", "*_knee"},
        {"*_ankle", "*_ankle"},
        {"*_foot", "*_foot|*_toe"},
        {"*_collar", "*_collar|*_thorax"},
        {"*_shoulder", "*_shoulder"},
        {"*_elbow", "*_elbow"},
        {"*_wrist", "*_wrist"},
        {"*_index1", "*_index1"},
        {"*_index2", "*_index2"},
        {"*_index3", "*_index3"},
        {"*_middle1", "*_middle1"},
        {"*_middle2", "*_middle2"},
        {"*_middle3", "*_middle3"},
        {"*_pinky1", "*_pinky1"},
        {"*_pinky2", "*_pinky2"},
        {"*_pinky3", "*_pinky3"},
        {"*_ring1", "*_ring1"},
        {"*_ring2", "*_ring2"},
        {"*_ring3", "*_ring3"},
        {"*_thumb1", "*_thumb1"},
        {"*_thumb2", "*_thumb2"},
        {"*_thumb3", "*_thumb3"}},
       {}},
      {"SmartBody",
       "Lf",
       "Rt",
       {{"pelvis", "JtPelvis|JtRoot"}, {"spine1", "JtSpineA"},      {"spine2", "JtSpineB"},
        {"spine3", "JtSpineC"},        {"neck", "JtNeckA"},         {"head", "JtSkullA"},
        {"*_hip", "JtHip*"},           {"*_knee", "JtKnee*"},       {"*_ankle", "JtAnkle*"},
        {"*_foot", "JtBall*"},         {"*_collar", "JtClavicle*"}, {"*_shoulder", "JtShoulder*"},
        {"*_elbow", "JtElbow*"},       {"*_wrist", "JtWrist*"},     {"*_index1", "JtIndexA*"},
        {"*_index2", "JtIndexB*"},     {"*_index3", "JtIndexC*"},   {"*_middle1", "JtMiddleA*"},
        {"*_middle2", "JtMiddleB*"},   {"*_middle3", "JtMiddleC*"}, {"*_pinky1", "JtLittleA*"},
        {"*_pinky2", "JtLittleB*"},    {"*_pinky3", "JtLittleC*"},  {"*_ring1", "JtRingA*"},
        {"*_ring2", "JtRingB*"},       {"*_ring3", "JtRingC*"},     {"*_thumb1", "JtThumbA*"},
        {"*_thumb2", "JtThumbB*"},     {"*_thumb3", "JtThumbC*"}},
       {}},
      {"SmartBody, anatomical names",
       "l",
       "r",
       {{"pelvis", "base"},
        {"spine1", "spine1"},
        {"spine2", "spine2"},
        {"spine3", "spine3"},
        {"neck", "spine4"},
        {"head", "skullbase"},
        {"*_hip", "*_hip"},
        {"*_knee", "*_knee"},
        {"*_ankle", "*_ankle"},
        {"*_foot", "*_forefoot"},
        {"*_collar", "*_sternoclavicular"},
        {"*_shoulder", "*_shoulder"},
        {"*_elbow", "*_elbow"},
        {"*_wrist", "*_wrist"},
        {"*_index1", "*_index1"},
        {"*_index2", "*_index2"},
        {"*_index3", "*_index3"},
        {"*_middle1", "*_middle1"},
        {"*_middle2", "*_middle2"},
        {"*_middle3", "*_middle3"},
        {"*_pinky1", "*_pinky1"},
        {"*_pinky2", "*_pinky2"},
        {"*_pinky3", "*_pinky3"},
        {"*_ring1", "*_ring1"},
        {"*_ring2", "*_ring2"},
        {"*_ring3", "*_ring3"},
        {"*_thumb1", "*_thumb1"},
        {"*_thumb2", "*_thumb2"},
        {"*_thumb3", "*_thumb3"}},
       {}},
      {"SmartBody, biped names",
       "L",
       "R",
       {{"pelvis", "Hip"},          {"spine1", "LowerSpine"},   {"spine2", "MiddleSpine"},
        {"spine3", "Chest"},        {"neck", "Neck"},           {"head", "Head"},
        {"*_hip", "*Thigh"},        {"*_knee", "*Shin"},        {"*_ankle", "*Foot"},
        {"*_foot", "*Toe"},         {"*_collar", "*Clavicle"},  {"*_shoulder", "*Shoulder"},
        {"*_elbow", "*Forearm"},    {"*_wrist", "*Hand"},       {"*_index1", "*Finger1"},
        {"*_index2", "*Finger11"},  {"*_index3", "*Finger12"},  {"*_middle1", "*Finger2"},
        {"*_middle2", "*Finger21"}, {"*_middle3", "*Finger22"}, {"*_ring1", "*Finger3"},
        {"*_ring2", "*Finger31"},   {"*_ring3", "*Finger32"},   {"*_pinky1", "*Finger4"},
        {"*_pinky2", "*Finger41"},  {"*_pinky3", "*Finger42"},  {"*_thumb1", "*Finger0"},
        {"*_thumb2", "*Finger01"},  {"*_thumb3", "*Finger02"}},
       {}},
      // LeftHand carries only the roll of the forearm there, LeftFingerBase the bend of the wrist.
      {"CMU, BVH",
       "Left",
       "Right",
       {{"pelvis", "Hips"},
        {"spine1", "LowerBack"},
        {"spine2", "Spine"},
        {"spine3", "Spine1"},
        {"neck", "Neck"},
        {"head", "Head"},
        {"*_hip", "*UpLeg"},
        {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"},
        {"*_foot", "*ToeBase"},
        {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"},
        {"*_elbow", "*ForeArm"},
        {"*_wrist", "*FingerBase"}},
       {"LHipJoint", "RHipJoint", "LowerBack", "LThumb", "RThumb"}},
      // The bone "lradius" ends two thirds down the forearm; "lwrist" is the last third.
      {"CMU, ASF/AMC",
       "l",
       "r",
       {{"pelvis", "root"},
        {"spine1", "lowerback"},
        {"spine2", "upperback"},
        {"spine3", "thorax"},
        {"neck", "lowerneck"},
        {"head", "head"},
        {"*_hip", "*femur"},
        {"*_knee", "*tibia"},
        {"*_ankle", "*foot"},
        {"*_foot", "*toes"},
        {"*_collar", "*clavicle"},
        {"*_shoulder", "*humerus"},
        {"*_elbow", "*radius"},
        {"*_wrist", "*hand"}},
       {}},
      {"ACCAD",
       "Left",
       "Right",
       {{"pelvis", "Hips"},
        {"spine1", "ToSpine"},
        {"spine2", "Spine"},
        {"spine3", "Spine1"},
        {"neck", "Neck"},
        {"head", "Head"},
        {"*_hip", "*UpLeg"},
        {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"},
        {"*_foot", "*ToeBase"},
        {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"},
        {"*_elbow", "*ForeArm"},
        {"*_wrist", "*Hand"}},
       {"ToSpine"},
       0.94},
      {"Mixamo",
       "Left",
       "Right",
       {{"pelvis", "Hips"},
        {"spine1", "Spine"},
        {"spine2", "Spine1"},
        {"spine3", "Spine2|Chest"},
        {"neck", "Neck"},
        {"head", "Head"},
        {"*_hip", "*UpLeg"},
        {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"},
        {"*_foot", "*ToeBase|*Toe"},
        {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"},
        {"*_elbow", "*ForeArm"},
        {"*_wrist", "*Hand"},
        {"*_index1", "*HandIndex1"},
        {"*_index2", "*HandIndex2"},
        {"*_index3", "*HandIndex3"},
        {"*_middle1", "*HandMiddle1"},
        {"*_middle2", "*HandMiddle2"},
        {"*_middle3", "*HandMiddle3"},
        {"*_pinky1", "*HandPinky1"},
        {"*_pinky2", "*HandPinky2"},
        {"*_pinky3", "*HandPinky3"},
        {"*_ring1", "*HandRing1"},
        {"*_ring2", "*HandRing2"},
        {"*_ring3", "*HandRing3"},
        {"*_thumb1", "*HandThumb1"},
        {"*_thumb2", "*HandThumb2"},
        {"*_thumb3", "*HandThumb3"}},
       {}},
      {"Poser",
       "Left",
       "Right",
       {{"pelvis", "Hips"},
        {"spine1", "Chest"},
        {"spine2", "Chest2"},
        {"spine3", "Chest4|Chest3"},
        {"neck", "Neck"},
        {"head", "Head"},
        {"*_hip", "*Hip"},
        {"*_knee", "*Knee"},
        {"*_ankle", "*Ankle"},
        {"*_foot", "*Toe"},
        {"*_collar", "*Collar"},
        {"*_shoulder", "*Shoulder"},
        {"*_elbow", "*Elbow"},
        {"*_wrist", "*Wrist"}},
       {}},
  };
  return tables;
}

constexpr std::string_view kRequired[] = {
    "pelvis",      "left_hip",    "right_hip",     "left_knee",      "right_knee",
    "left_ankle",  "right_ankle", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist",  "right_wrist"};

std::string WithSide(std::string_view pattern, std::string_view side) {
  std::string name(pattern);
  const std::size_t star = name.find('*');
  if (star != std::string::npos) name.replace(star, 1, side);
  return name;
}

std::string_view WithoutPrefix(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

int FindSource(const SourceMotion& motion, std::string_view patterns, std::string_view side) {
  while (!patterns.empty()) {
    const std::size_t bar = std::min(patterns.find('|'), patterns.size());
    const std::string name = WithSide(patterns.substr(0, bar), side);
    for (int j = 0; j < motion.NumJoints(); ++j) {
      if (EqualIgnoringCase(WithoutPrefix(motion.joint_names[j]), name)) return j;
    }
    patterns.remove_prefix(std::min(bar + 1, patterns.size()));
  }
  return -1;
}

SkeletonMap Apply(const Table& table, const SourceMotion& motion) {
  SkeletonMap map;
  map.name = table.name;
  map.source.fill(-1);
  map.lumbar_lean = table.lumbar_lean;
  for (const Row& row : table.rows) {
    const bool sided = row.target.starts_with('*');
    map.source[*FindJoint(WithSide(row.target, "left"))] =
        FindSource(motion, row.sources, table.left);
    if (sided) {
      map.source[*FindJoint(WithSide(row.target, "right"))] =
          FindSource(motion, row.sources, table.right);
    }
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

// An ancestor must stand for an ancestor: catches sides swapped and limbs crossed.
void CheckTree(const SkeletonMap& map, const SourceMotion& motion, const std::string& where) {
  for (int j = 1; j < kNumJoints; ++j) {
    if (map.source[j] < 0) continue;
    int above = kJointParents[j];
    while (above >= 0 && map.source[above] < 0) above = kJointParents[above];
    // The pelvis may hang beside the spine (a root above both); so may whatever hangs on it.
    if (above <= 0) continue;
    int s = motion.parents[map.source[j]];
    while (s >= 0 && s != map.source[above]) s = motion.parents[s];
    if (s < 0) {
      throw Error(where,
                  fmt::format("'{}' stands for {} but does not hang on '{}', which stands for {}",
                              motion.joint_names[map.source[j]], kJointNames[j],
                              motion.joint_names[map.source[above]], kJointNames[above]),
                  kMapRemedy);
    }
  }
}

}  // namespace

int SkeletonMap::NumMapped() const {
  return static_cast<int>(
      std::count_if(source.begin(), source.end(), [](int s) { return s >= 0; }));
}

std::vector<std::string> SkeletonMap::UnusedSourceJoints(const SourceMotion& motion) const {
  std::vector<std::string> unused;
  for (int j = 0; j < motion.NumJoints(); ++j) {
    if (std::find(source.begin(), source.end(), j) == source.end()) {
      unused.push_back(motion.joint_names[j]);
    }
  }
  return unused;
}

SkeletonMap RecognizeSkeleton(const SourceMotion& motion, const std::string& where) {
  std::optional<SkeletonMap> best;
  std::size_t best_missing = 0;
  int best_score = 0;
  for (const Table& table : Tables()) {
    SkeletonMap map = Apply(table, motion);
    const std::size_t missing = MissingLimbs(map).size();
    int score = map.NumMapped();
    for (const std::string_view mark : table.marks) {
      if (FindSource(motion, mark, "") >= 0) score += 2;
    }
    if (!best || missing < best_missing || (missing == best_missing && score > best_score)) {
      best = std::move(map);
      best_missing = missing;
      best_score = score;
    }
  }
  if (best_missing > 0) {
    throw Error(where,
                fmt::format("a skeleton of unknown naming: the nearest is '{}', which finds no {}; "
                            "the joints here are {}",
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
      throw Error(where, fmt::format("'{}' is no joint of SMPL-X", target_name.get<std::string>()),
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
  for (const Table& table : Tables()) names.emplace_back(table.name);
  return names;
}

}  // namespace holdfast
