// SPDX-License-Identifier: MIT
#include "geometry/retarget/skeleton_map.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/retarget/skeleton_tables.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using testing::ErrorText;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

// A motion of one frame with SMPL-X's tree and other names.
SourceMotion Named(const std::map<std::string, std::string>& names) {
  SourceMotion motion;
  std::array<int, kNumJoints> at;
  at.fill(-1);
  for (int j = 0; j < kNumJoints; ++j) {
    const auto name = names.find(std::string(kJointNames[j]));
    if (name == names.end()) continue;
    int parent = kJointParents[j];
    while (parent >= 0 && at[parent] < 0) parent = kJointParents[parent];
    at[j] = motion.NumJoints();
    motion.joint_names.push_back(name->second);
    motion.parents.push_back(parent < 0 ? -1 : at[parent]);
  }
  motion.rest_offsets = Eigen::Matrix3Xd::Zero(3, motion.NumJoints());
  motion.positions.push_back(motion.rest_offsets);
  motion.rotations.assign(motion.joint_names.size(), Eigen::Quaterniond::Identity());
  return motion;
}

std::map<std::string, std::string> MixamoNames(const std::string& prefix) {
  std::map<std::string, std::string> names = {{"pelvis", "Hips"},   {"spine1", "Spine"},
                                              {"spine2", "Spine1"}, {"spine3", "Spine2"},
                                              {"neck", "Neck"},     {"head", "Head"}};
  for (const auto& [side, word] :
       {std::pair<std::string, std::string>{"left", "Left"}, {"right", "Right"}}) {
    names[side + "_hip"] = word + "UpLeg";
    names[side + "_knee"] = word + "Leg";
    names[side + "_ankle"] = word + "Foot";
    names[side + "_foot"] = word + "ToeBase";
    names[side + "_collar"] = word + "Shoulder";
    names[side + "_shoulder"] = word + "Arm";
    names[side + "_elbow"] = word + "ForeArm";
    names[side + "_wrist"] = word + "Hand";
    names[side + "_index1"] = word + "HandIndex1";
  }
  for (auto& [joint, name] : names) name = prefix + name;
  return names;
}

TEST(SkeletonMap, RecognizesEverySmplxJointByItsOwnName) {
  std::map<std::string, std::string> names;
  for (const auto name : kJointNames) names[std::string(name)] = name;
  const SourceMotion motion = Named(names);
  const SkeletonMap map = RecognizeSkeleton(motion, "x");
  EXPECT_EQ(map.name, "SMPL");
  EXPECT_GE(map.NumMapped(), 53);
  for (int j = 0; j < kNumJoints; ++j) {
    if (map.source[j] < 0) continue;
    EXPECT_EQ(motion.joint_names[map.source[j]], kJointNames[j]);
  }
}

TEST(SkeletonMap, PrefixesAndLetterCaseDoNotCount) {
  for (const std::string prefix : {"", "mixamorig:", "Character1:mixamorig:", "Character1_",
                                   "hero|rig|", "/root/Armature/", "my rig - "}) {
    const SkeletonMap map = RecognizeSkeleton(Named(MixamoNames(prefix)), "x");
    EXPECT_EQ(map.name, "Mixamo") << prefix;
    EXPECT_EQ(map.NumMapped(), 24) << prefix;
  }
}

// No table takes another's skeletons for its own, and all of each table's names are found.
TEST(SkeletonMap, EveryTableRecognizesItsOwnSkeletons) {
  for (const SkeletonTable& table : SkeletonTables()) {
    const std::string prefix(table.prefixes.substr(0, table.prefixes.find('|')));
    std::map<std::string, std::string> names;
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const std::string_view word = side == Side::kLeft ? table.left : table.right;
      const auto add = [&](const std::string& target, std::string_view sources) {
        names[target] = prefix + SideName(sources.substr(0, sources.find('|')), word);
      };
      for (const auto& [target, sources] : table.rows) {
        add(SideName(target, ::holdfast::SideName(side)), sources);
      }
      for (std::size_t k = 0; k < table.fingers.size(); ++k) {
        add(std::string(kJointNames[HandBegin(side) + k]), table.fingers[k]);
      }
    }
    SourceMotion motion = Named(names);
    for (const std::string_view mark : table.marks) {
      const auto named = [&](const std::string& name) {
        return SkeletonKey(name) == SkeletonKey(mark);
      };
      if (std::any_of(motion.joint_names.begin(), motion.joint_names.end(), named)) continue;
      motion.joint_names.push_back(prefix + std::string(mark));
      motion.parents.push_back(0);
    }
    const SkeletonMap map = RecognizeSkeleton(motion, "x");
    EXPECT_EQ(map.name, table.name);
    EXPECT_EQ(map.NumMapped(), static_cast<int>(names.size())) << table.name;
  }
}

TEST(SkeletonMap, SeparatorsAndAddedNumbersDoNotCount) {
  auto names = MixamoNames("mixamorig");  // three.js leaves the colon out
  EXPECT_EQ(RecognizeSkeleton(Named(names), "x").NumMapped(), 24);
  int number = 0;
  for (auto& [joint, name] : names) name += "_0" + std::to_string(number++);
  EXPECT_EQ(RecognizeSkeleton(Named(names), "x").NumMapped(), 24);
  names = MixamoNames("");
  names["left_hip"] = "Left_Up-Leg";
  names["right_hip"] = "right up.leg";
  EXPECT_EQ(RecognizeSkeleton(Named(names), "x").NumMapped(), 24);
}

TEST(SkeletonMap, TheRootMayLackThePrefixOfTheOthers) {
  auto names = MixamoNames("Character1_");
  names["pelvis"] = "Hips";
  EXPECT_EQ(RecognizeSkeleton(Named(names), "x").NumMapped(), 24);
}

// Vrm's map comes before all names; one that lacks a limb does not count.
TEST(SkeletonMap, VrmsBonesComeBeforeNames) {
  SourceMotion motion = Named(MixamoNames(""));
  const auto joint = [&](const std::string& name) {
    return static_cast<int>(std::ranges::find(motion.joint_names, name) -
                            motion.joint_names.begin());
  };
  motion.humanoid = {{"hips", joint("Hips")}, {"spine", joint("Spine1")}, {"head", joint("Head")}};
  for (const auto& [side, word] :
       {std::pair<std::string, std::string>{"left", "Left"}, {"right", "Right"}}) {
    for (const auto& [bone, name] : {std::pair{"UpperLeg", "UpLeg"},
                                     {"LowerLeg", "Leg"},
                                     {"Foot", "Foot"},
                                     {"UpperArm", "Arm"},
                                     {"LowerArm", "ForeArm"},
                                     {"Hand", "Hand"}}) {
      motion.humanoid[side + bone] = joint(word + name);
    }
  }
  const SkeletonMap map = RecognizeSkeleton(motion, "x");
  EXPECT_EQ(map.name, "VRM humanoid");
  EXPECT_EQ(map.NumMapped(), 15);
  EXPECT_EQ(map.source[*FindJoint("spine1")], joint("Spine1"));
  motion.humanoid.erase("leftFoot");
  EXPECT_EQ(RecognizeSkeleton(motion, "x").name, "Mixamo");
}

TEST(SkeletonMap, AnUnknownNamingIsAnErrorThatHelps) {
  auto names = MixamoNames("");
  names["left_elbow"] = "Ellbogen";
  EXPECT_THAT(ErrorText([&] { RecognizeSkeleton(Named(names), "dance.bvh"); }),
              AllOf(HasSubstr("dance.bvh"), HasSubstr("left_elbow"), HasSubstr("Ellbogen"),
                    HasSubstr("--map")));
}

TEST(SkeletonMap, AMapFileOverrides) {
  auto names = MixamoNames("");
  for (auto& [joint, name] : names) name = "my " + name;
  const SourceMotion motion = Named(names);
  const TemporaryFolder folder;
  const auto write = [&](const std::string& text) {
    std::ofstream(folder / "map.json") << text;
    return folder / "map.json";
  };
  std::string all = "{";
  for (const auto& [joint, name] : names) all += "\"" + name + "\": \"" + joint + "\",";
  all.back() = '}';
  const SkeletonMap map = ReadSkeletonMap(write(all), motion);
  EXPECT_EQ(map.NumMapped(), 24);
  EXPECT_EQ(motion.joint_names[map.source[*FindJoint("left_knee")]], "my LeftLeg");
  EXPECT_TRUE(map.UnusedSourceJoints(motion).empty());

  const auto fault = [&](const std::string& text, const std::string& part) {
    EXPECT_THAT(ErrorText([&] { ReadSkeletonMap(write(text), motion); }),
                AllOf(HasSubstr("map.json"), HasSubstr(part)))
        << text;
  };
  fault("", "is empty");
  fault("[]", "JSON");
  fault("{\"my Hips\": 3}", "my Hips");
  fault("{\"my Hips\": \"nose\"}", "nose");
  fault("{\"Hips\": \"pelvis\"}", "no joint 'Hips'");
  fault("{\"my Hips\": \"pelvis\", \"my Spine\": \"pelvis\"}", "two joints");
  fault("{\"my Hips\": \"pelvis\"}", "left_hip");
  std::string crossed = all;
  const auto swap = [&](const std::string& a, const std::string& b) {
    crossed.replace(crossed.find("\"" + a + "\""), a.size() + 2, "\"#\"");
    crossed.replace(crossed.find("\"" + b + "\""), b.size() + 2, "\"" + a + "\"");
    crossed.replace(crossed.find("\"#\""), 3, "\"" + b + "\"");
  };
  swap("left_elbow", "right_elbow");
  fault(crossed, "is not below");
}

TEST(SkeletonMap, ListsItsTables) {
  EXPECT_THAT(KnownSkeletons(), AllOf(Contains("SmartBody"), Contains("CMU, ASF/AMC"),
                                      Contains("ACCAD"), Contains("Mixamo")));
}

}  // namespace
}  // namespace holdfast
