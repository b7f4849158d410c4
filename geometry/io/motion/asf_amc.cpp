// SPDX-License-Identifier: MIT
#include "geometry/io/motion/asf_amc.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxBones = 1000;
constexpr double kInch = 0.0254;

enum class Freedom { kTx, kTy, kTz, kRx, kRy, kRz, kLength };
constexpr std::string_view kFreedomNames[] = {"tx", "ty", "tz", "rx", "ry", "rz", "l"};

struct Bone {
  std::string name;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // skeleton axes, unit length
  double length = 0;                                    // units of the file
  Eigen::Quaterniond axis = Eigen::Quaterniond::Identity();
  std::vector<Freedom> freedoms;
  int parent = -1;
};

struct Skeleton {
  std::vector<Bone> bones = std::vector<Bone>(1);  // bones[0] is the root
  Eigen::Vector3d root_position = Eigen::Vector3d::Zero();
  double length_unit = 1;
  double angle_unit = kDegree;
  std::map<std::string, int, std::less<>> bone_of_name = {{"root", 0}};

  Skeleton() { bones[0].name = "root"; }

  int Find(std::string_view name) const {
    const auto found = bone_of_name.find(name);
    return found == bone_of_name.end() ? -1 : found->second;
  }
  void Add(Bone bone) {
    bone_of_name[bone.name] = static_cast<int>(bones.size());
    bones.push_back(std::move(bone));
  }
};

Eigen::Quaterniond Turn(int axis, double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
}

// "XYZ": rotates about x first, then y, then z, all about fixed axes.
Eigen::Quaterniond EulerInOrder(TextScanner& scanner, std::string_view order,
                                const Eigen::Vector3d& angles) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  unsigned seen = 0;
  for (const char letter : order) {
    const std::size_t axis = std::string_view("XYZxyz").find(letter) % 3;
    if (std::string_view("XYZxyz").find(letter) == std::string_view::npos || (seen >> axis & 1)) {
      scanner.Fail("an axis order that is not a permutation of XYZ", "Repair the line");
    }
    seen |= 1u << axis;
    q = Turn(static_cast<int>(axis), angles[static_cast<int>(axis)]) * q;
  }
  if (seen != 7) scanner.Fail("an axis order that is not a permutation of XYZ", "Repair the line");
  return q;
}

Eigen::Vector3d ReadVector(TextScanner& scanner, std::string_view what) {
  Eigen::Vector3d v;
  for (double& x : v) x = scanner.Number(what);
  return v;
}

bool AtSection(TextScanner& scanner) { return scanner.AtEnd() || scanner.Peek().starts_with(':'); }

// Adds those on the rest of the line.
void ReadFreedoms(TextScanner& scanner, std::string_view repeats, std::vector<Freedom>& freedoms) {
  while (!scanner.PeekOnLine().empty()) {
    const std::string_view word = scanner.Next();
    const auto* const name = std::ranges::find_if(
        kFreedomNames, [&](std::string_view known) { return EqualIgnoringCase(word, known); });
    if (name == std::end(kFreedomNames)) {
      scanner.Fail("a degree of freedom that is not one of tx ty tz rx ry rz l", "Repair the line");
    }
    const auto freedom = static_cast<Freedom>(name - std::begin(kFreedomNames));
    if (std::ranges::find(freedoms, freedom) != freedoms.end()) {
      scanner.Fail(repeats, "Repair the line");
    }
    freedoms.push_back(freedom);
  }
}

void ReadUnits(TextScanner& scanner, Skeleton& skeleton) {
  while (!AtSection(scanner)) {
    const std::string_view key = scanner.Next();
    if (EqualIgnoringCase(key, "angle")) {
      const bool radians = EqualIgnoringCase(scanner.Next().substr(0, 3), "rad");
      skeleton.angle_unit = radians ? 1 : kDegree;
    } else if (EqualIgnoringCase(key, "length")) {
      skeleton.length_unit = scanner.Number("the length unit");
      if (!(skeleton.length_unit > 1e-6) || skeleton.length_unit > 1e6) {
        scanner.Fail("an invalid length unit", "Write 'length 0.45' as CMU does");
      }
    } else {
      scanner.RestOfLine();
    }
  }
}

void ReadRoot(TextScanner& scanner, Skeleton& skeleton) {
  std::string axis_order = "XYZ";
  Eigen::Vector3d orientation = Eigen::Vector3d::Zero();
  while (!AtSection(scanner)) {
    const std::string_view key = scanner.Next();
    if (EqualIgnoringCase(key, "order")) {
      skeleton.bones[0].freedoms.clear();
      ReadFreedoms(scanner, "a root channel that repeats", skeleton.bones[0].freedoms);
    } else if (EqualIgnoringCase(key, "axis")) {
      axis_order = scanner.Next();
    } else if (EqualIgnoringCase(key, "position")) {
      skeleton.root_position = ReadVector(scanner, "the root's position");
    } else if (EqualIgnoringCase(key, "orientation")) {
      orientation = ReadVector(scanner, "the root's orientation");
    } else {
      scanner.Fail("an unknown word in :root", "Expected order, axis, position or orientation");
    }
  }
  skeleton.bones[0].axis = EulerInOrder(scanner, axis_order, skeleton.angle_unit * orientation);
}

void ReadBone(TextScanner& scanner, Skeleton& skeleton) {
  scanner.Expect("begin", "each bone is between begin and end");
  if (static_cast<int>(skeleton.bones.size()) == kMaxBones) {
    scanner.Fail(fmt::format("more than {} bones", kMaxBones), "Give a body's skeleton");
  }
  Bone bone;
  while (true) {
    const std::string_view key = scanner.Next();
    if (EqualIgnoringCase(key, "end")) break;
    if (EqualIgnoringCase(key, "name")) {
      bone.name = scanner.Next();
    } else if (EqualIgnoringCase(key, "direction")) {
      bone.direction = ReadVector(scanner, "a bone's direction");
    } else if (EqualIgnoringCase(key, "length")) {
      bone.length = scanner.Number("a bone's length");
    } else if (EqualIgnoringCase(key, "axis")) {
      const Eigen::Vector3d angles = skeleton.angle_unit * ReadVector(scanner, "a bone's axis");
      bone.axis = EulerInOrder(scanner, scanner.Next(), angles);
    } else if (EqualIgnoringCase(key, "dof")) {
      ReadFreedoms(scanner, "a degree of freedom that repeats", bone.freedoms);
    } else if (key.empty() || key.starts_with(':')) {
      scanner.Fail("ends inside a bone", "Close the bone with 'end'");
    } else {
      // id, limits and their brackets, mass, offset of the body: irrelevant for the motion.
      scanner.RestOfLine();
    }
  }
  if (bone.name.empty()) scanner.Fail("a bone without a name", "Name the bone");
  if (skeleton.Find(bone.name) >= 0) {
    scanner.Fail("a second bone of the same name", "Name each bone differently");
  }
  const double norm = bone.direction.stableNorm();
  if (norm > 0) bone.direction /= norm;
  if (norm == 0 && bone.length != 0) {
    scanner.Fail("a bone with a length but no direction", "Repair the bone");
  }
  skeleton.Add(std::move(bone));
}

void ReadHierarchy(TextScanner& scanner, Skeleton& skeleton) {
  scanner.Expect("begin", "the hierarchy is between begin and end");
  while (true) {
    const std::string_view word = scanner.Next();
    if (EqualIgnoringCase(word, "end")) break;
    if (word.empty() || word.starts_with(':')) {
      scanner.Fail("ends inside the hierarchy", "Close it with 'end'");
    }
    const int parent = skeleton.Find(word);
    if (parent < 0) scanner.Fail("an unknown bone in the hierarchy", "Add it to :bonedata");
    while (!scanner.PeekOnLine().empty()) {
      const int child = skeleton.Find(scanner.Next());
      if (child < 0) scanner.Fail("an unknown bone in the hierarchy", "Add it to :bonedata");
      if (child == 0 || skeleton.bones[child].parent >= 0) {
        scanner.Fail("a bone with two parents", "Repair the hierarchy");
      }
      skeleton.bones[child].parent = parent;
    }
  }
}

// Orders bones with parents first; detects loops and disconnected bones.
std::vector<int> ParentsFirst(const TextScanner& scanner, const Skeleton& skeleton) {
  std::vector<std::vector<int>> children(skeleton.bones.size());
  for (std::size_t i = 1; i < skeleton.bones.size(); ++i) {
    const Bone& bone = skeleton.bones[i];
    if (bone.parent < 0) {
      throw Error(scanner.Where(), fmt::format("bone '{}' is not in :hierarchy", bone.name),
                  "Add it under its parent");
    }
    children[bone.parent].push_back(static_cast<int>(i));
  }
  std::vector<int> order{0};
  for (std::size_t i = 0; i < order.size(); ++i) {
    order.insert(order.end(), children[order[i]].begin(), children[order[i]].end());
  }
  if (order.size() != skeleton.bones.size()) {
    throw Error(scanner.Where(), "bones that form a cycle", "Repair :hierarchy");
  }
  return order;
}

Skeleton ParseSkeleton(TextScanner& scanner) {
  Skeleton skeleton;
  bool has_root = false, has_bones = false, has_hierarchy = false;
  if (!scanner.Peek().starts_with(':')) {
    scanner.Next();
    scanner.Fail("not an Acclaim skeleton (no ':' section at its start)", "Give the .asf file");
  }
  while (!scanner.AtEnd()) {
    const std::string_view section = scanner.Next();
    if (EqualIgnoringCase(section, ":units")) {
      ReadUnits(scanner, skeleton);
    } else if (EqualIgnoringCase(section, ":root")) {
      has_root = true;
      ReadRoot(scanner, skeleton);
    } else if (EqualIgnoringCase(section, ":bonedata")) {
      has_bones = true;
      while (!AtSection(scanner)) ReadBone(scanner, skeleton);
    } else if (EqualIgnoringCase(section, ":hierarchy")) {
      has_hierarchy = true;
      ReadHierarchy(scanner, skeleton);
    } else {  // :version, :name, :documentation, :skin
      scanner.RestOfLine();
      while (!AtSection(scanner)) {
        scanner.Next();
        scanner.RestOfLine();
      }
    }
  }
  if (!has_root || !has_bones || !has_hierarchy) {
    scanner.Fail(fmt::format("no {} section", !has_root    ? ":root"
                                              : !has_bones ? ":bonedata"
                                                           : ":hierarchy"),
                 "Give a whole .asf file");
  }
  return skeleton;
}

struct BonePose {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double stretch = 0;
};

BonePose ReadBonePose(TextScanner& scanner, const Bone& bone, double angle_unit) {
  BonePose pose;
  for (const Freedom freedom : bone.freedoms) {
    if (scanner.PeekOnLine().empty()) {
      scanner.Fail(
          fmt::format("fewer than {} numbers for bone '{}'", bone.freedoms.size(), bone.name),
          "Use the skeleton that the motion was made with, or repair the line");
    }
    const double value = scanner.Number("a bone's value");
    const int axis = static_cast<int>(freedom) % 3;
    if (freedom == Freedom::kLength) {
      pose.stretch = value;
    } else if (freedom >= Freedom::kRx) {
      pose.turn = Turn(axis, std::remainder(value * angle_unit, 2 * std::numbers::pi)) * pose.turn;
    } else {
      pose.shift[axis] = value;
    }
  }
  if (!scanner.PeekOnLine().empty()) {
    scanner.Fail(fmt::format("more than {} numbers for bone '{}'", bone.freedoms.size(), bone.name),
                 "Use the skeleton that the motion was made with");
  }
  return pose;
}

// Reads a frame: its number, then whole lines of "bone values" up to the next frame's number.
std::vector<BonePose> ReadFrame(TextScanner& scanner, const Skeleton& skeleton, double angle_unit) {
  std::vector<BonePose> poses(skeleton.bones.size());
  std::vector<bool> seen(skeleton.bones.size(), false);
  const std::string frame =
      fmt::format("frame {}", scanner.Integer("a frame's number", 0, 1 << 30));
  double number = 0;
  while (!scanner.AtEnd() && !ParseNumber(scanner.Peek(), number)) {
    const std::string name(scanner.Next());
    const int bone = skeleton.Find(name);
    if (bone < 0) {
      scanner.Fail(fmt::format("{} moves a bone that the skeleton lacks", frame),
                   "Use the skeleton that the motion was made with");
    }
    if (seen[bone]) scanner.Fail(fmt::format("{} moves a bone twice", frame), "Repair the frame");
    seen[bone] = true;
    poses[bone] = ReadBonePose(scanner, skeleton.bones[bone], angle_unit);
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i] && !skeleton.bones[i].freedoms.empty()) {
      scanner.Fail(fmt::format("{} lacks bone '{}'", frame, skeleton.bones[i].name),
                   "The frame is cut short: remove it, or fetch the file again");
    }
  }
  return poses;
}

// Counts the lines from here on that begin with a number: frames begin only there.
std::size_t CountFrames(TextScanner ahead) {
  std::size_t frames = 0;
  double number = 0;
  while (!ahead.AtEnd()) {
    frames += ParseNumber(ahead.Next(), number);
    ahead.RestOfLine();
  }
  return frames;
}

// Sets names, parents, offsets and end sites of the joints in the order of `order`; `scale` is in
// meters per unit.
void SetRestBones(const Skeleton& skeleton, const std::vector<int>& order, double scale,
                  SourceMotion& motion) {
  const int num_joints = static_cast<int>(order.size());
  std::vector<int> joint_of(order.size());
  for (int j = 0; j < num_joints; ++j) joint_of[order[j]] = j;
  motion.rest_offsets.resize(3, num_joints);
  std::vector<bool> has_child(order.size(), false);
  for (int j = 0; j < num_joints; ++j) {
    const Bone& bone = skeleton.bones[order[j]];
    motion.joint_names.push_back(bone.name);
    motion.parents.push_back(bone.parent < 0 ? -1 : joint_of[bone.parent]);
    if (bone.parent < 0) {
      motion.rest_offsets.col(j) = scale * skeleton.root_position;
    } else {
      const Bone& above = skeleton.bones[bone.parent];
      motion.rest_offsets.col(j) = scale * above.length * above.direction;
      has_child[motion.parents[j]] = true;
    }
  }
  for (int j = 0; j < num_joints; ++j) {
    const Bone& bone = skeleton.bones[order[j]];
    if (!has_child[j]) motion.end_sites.push_back({j, scale * bone.length * bone.direction});
  }
}

// Returns the angle unit that the motion's header names, else the skeleton's.
double ReadAngleUnit(TextScanner& amc, double angle_unit) {
  while (amc.Peek().starts_with(':')) {
    const std::string_view word = amc.Next();
    if (EqualIgnoringCase(word, ":RADIANS")) angle_unit = 1;
    if (EqualIgnoringCase(word, ":DEGREES")) angle_unit = kDegree;
    amc.RestOfLine();
  }
  return angle_unit;
}

// Adds the world rotations of a frame's joints to the motion, and returns their positions.
Eigen::Matrix3Xd PlaceBones(const Skeleton& skeleton, const std::vector<int>& order, double scale,
                            const std::vector<BonePose>& poses, SourceMotion& motion) {
  const int num_joints = static_cast<int>(order.size());
  Eigen::Matrix3Xd position(3, num_joints);
  const std::size_t begin = motion.rotations.size();
  for (int j = 0; j < num_joints; ++j) {
    const Bone& bone = skeleton.bones[order[j]];
    const BonePose& pose = poses[order[j]];
    const Eigen::Quaterniond local = bone.axis * pose.turn * bone.axis.conjugate();
    if (j == 0) {
      motion.rotations.push_back((pose.turn * bone.axis).normalized());
      position.col(0) = motion.rest_offsets.col(0) + scale * pose.shift;
      continue;
    }
    const int parent = motion.parents[j];
    const Eigen::Quaterniond& above = motion.rotations[begin + parent];
    const Bone& parent_bone = skeleton.bones[order[parent]];
    const Eigen::Vector3d offset =
        scale * ((parent == 0 ? 0.0 : parent_bone.length + poses[order[parent]].stretch) *
                     parent_bone.direction +
                 bone.axis * pose.shift);
    position.col(j) = position.col(parent) + above * offset;
    motion.rotations.push_back((above * local).normalized());
  }
  return position;
}

}  // namespace

SourceMotion ParseAmc(std::string_view asf_text, std::string asf_name, std::string_view amc_text,
                      std::string amc_name, double meters_per_unit, double frame_rate) {
  TextScanner asf(std::move(asf_name), asf_text, '#');
  const Skeleton skeleton = ParseSkeleton(asf);
  const std::vector<int> order = ParentsFirst(asf, skeleton);
  const double scale = meters_per_unit > 0 ? meters_per_unit : kInch / skeleton.length_unit;

  SourceMotion motion;
  motion.format = "ASF/AMC";
  motion.frame_rate = frame_rate;
  SetRestBones(skeleton, order, scale, motion);
  if (!motion.rest_offsets.allFinite()) {
    throw Error(asf.Where(), "bone lengths that overflow", "Repair the lengths");
  }

  TextScanner amc(std::move(amc_name), amc_text, '#');
  const double angle_unit = ReadAngleUnit(amc, skeleton.angle_unit);
  const std::size_t num_frames = CountFrames(amc);
  CheckMemoryBudget(amc, static_cast<double>(num_frames), static_cast<int>(order.size()),
                    amc_text.size());
  motion.positions.reserve(num_frames);
  motion.rotations.reserve(num_frames * order.size());
  while (!amc.AtEnd()) {
    if (static_cast<std::size_t>(motion.NumFrames()) == num_frames) {
      amc.Fail("a frame number that is not at the start of a line",
               "Begin each frame on a new line");
    }
    const std::vector<BonePose> poses = ReadFrame(amc, skeleton, angle_unit);
    Eigen::Matrix3Xd position = PlaceBones(skeleton, order, scale, poses, motion);
    if (!position.allFinite()) {
      amc.Fail("positions that overflow", "Repair the skeleton and the frame");
    }
    motion.positions.push_back(std::move(position));
  }
  if (motion.positions.empty()) amc.Fail("holds no frames", "Give a motion with frames");
  return motion;
}

std::filesystem::path FindAsfBeside(const std::filesystem::path& amc) {
  const auto is_skeleton = [](const std::string& name) {
    return name.ends_with(".asf") || name.ends_with(".asf.gz") || name.ends_with(".ASF") ||
           name.ends_with(".ASF.gz");
  };
  const std::filesystem::path folder = amc.has_parent_path() ? amc.parent_path() : ".";
  const std::string motion_name = amc.filename().string();
  std::map<std::size_t, std::filesystem::path> by_prefix;
  std::vector<std::filesystem::path> all;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!is_skeleton(name)) continue;
    all.push_back(entry.path());
    const std::string stem =
        name.substr(0, name.find(".asf") == name.npos ? name.find(".ASF") : name.find(".asf"));
    if (motion_name.starts_with(stem)) by_prefix[stem.size()] = entry.path();
  }
  if (!by_prefix.empty()) return by_prefix.rbegin()->second;
  if (all.size() == 1) return all.front();
  throw Error(amc.string(),
              all.empty() ? "is an Acclaim motion without a skeleton (.asf) beside it"
                          : "is an Acclaim motion, but its name does not start with the name of "
                            "any skeleton (.asf) beside it",
              "Name the skeleton with --asf FILE");
}

SourceMotion ReadAmc(const std::filesystem::path& path) {
  const std::filesystem::path asf = FindAsfBeside(path);
  std::vector<std::string> notes;
  const std::string asf_text = PlainText(ReadGzipText(asf), notes);
  const std::string amc_text = PlainText(ReadGzipText(path), notes);
  SourceMotion motion = ParseAmc(asf_text, asf.string(), amc_text, path.string());
  motion.notes = std::move(notes);
  return motion;
}

}  // namespace holdfast
