// SPDX-License-Identifier: MIT
#include "geometry/retarget/skeleton_tables.h"

#include <cctype>
#include <initializer_list>

#include <fmt/format.h>

namespace holdfast {
namespace {

// Names of the finger joints: `pattern` with each finger (index, middle, pinky, ring, and thumb
// unless its joints are given) and each of its three joints.
std::vector<std::string> Fingers(std::string_view pattern,
                                 std::initializer_list<std::string_view> fingers,
                                 std::initializer_list<std::string_view> joints,
                                 std::initializer_list<std::string_view> thumb = {}) {
  std::vector<std::string> names;
  for (const std::string_view finger : fingers) {
    for (const std::string_view joint : joints) {
      names.push_back(fmt::format(fmt::runtime(pattern), finger, joint));
    }
  }
  names.insert(names.end(), thumb.begin(), thumb.end());
  return names;
}

}  // namespace

std::string SkeletonKey(std::string_view name) {
  const std::size_t space = name.find_last_of(":|/");  // end of a namespace or a path
  if (space != std::string_view::npos) name.remove_prefix(space + 1);
  std::string key;
  key.reserve(name.size());
  for (const char c : name) {
    if (c == ' ' || c == '_' || c == '-' || c == '.') continue;
    key.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  return key;
}

std::string SideName(std::string_view pattern, std::string_view side) {
  std::string name(pattern);
  if (const std::size_t star = name.find('*'); star != name.npos) name.replace(star, 1, side);
  if (const std::size_t hash = name.find('#'); hash != name.npos) {
    name.replace(hash, 1, side.substr(0, 1));
  }
  return name;
}

const std::vector<SkeletonTable>& SkeletonTables() {
  // clang-format off
  static const std::vector<SkeletonTable> tables = {
      {"SMPL", "left", "right",
       {{"pelvis", "pelvis"}, {"spine1", "spine1"}, {"spine2", "spine2"}, {"spine3", "spine3"},
        {"neck", "neck"}, {"head", "head"}, {"jaw", "jaw"}, {"*_eye", "*_eye|*_eye_smplhf"},
        {"*_hip", "*_hip"}, {"*_knee", "*_knee"}, {"*_ankle", "*_ankle"}, {"*_foot", "*_foot"},
        {"*_collar", "*_collar"}, {"*_shoulder", "*_shoulder"}, {"*_elbow", "*_elbow"},
        {"*_wrist", "*_wrist"}},
       Fingers("*_{}{}", {"index", "middle", "pinky", "ring", "thumb"}, {"1", "2", "3"}),
       {}},
      {"SMPL, short names", "L", "R",
       {{"pelvis", "pelvis"}, {"spine1", "spine1|torso"}, {"spine2", "spine2|spine"},
        {"spine3", "spine3|chest"}, {"neck", "neck"}, {"head", "head"}, {"*_hip", "*_hip"},
        {"*_knee", "*_knee"}, {"*_ankle", "*_ankle"}, {"*_foot", "*_foot|*_toe"},
        {"*_collar", "*_collar|*_thorax"}, {"*_shoulder", "*_shoulder"}, {"*_elbow", "*_elbow"},
        {"*_wrist", "*_wrist"}},
       Fingers("*_{}{}", {"index", "middle", "pinky", "ring", "thumb"}, {"1", "2", "3"}),
       {}, std::nullopt, "m_avg_|f_avg_"},
      {"SmartBody", "Lf", "Rt",
       {{"pelvis", "JtPelvis|JtRoot"}, {"spine1", "JtSpineA"}, {"spine2", "JtSpineB"},
        {"spine3", "JtSpineC"}, {"neck", "JtNeckA"}, {"head", "JtSkullA"}, {"*_hip", "JtHip*"},
        {"*_knee", "JtKnee*"}, {"*_ankle", "JtAnkle*"}, {"*_foot", "JtBall*"},
        {"*_collar", "JtClavicle*"}, {"*_shoulder", "JtShoulder*"}, {"*_elbow", "JtElbow*"},
        {"*_wrist", "JtWrist*"}},
       Fingers("Jt{}{}*", {"Index", "Middle", "Little", "Ring", "Thumb"}, {"A", "B", "C"}),
       {}},
      {"SmartBody, anatomical names", "l", "r",
       {{"pelvis", "base"}, {"spine1", "spine1"}, {"spine2", "spine2"}, {"spine3", "spine3"},
        {"neck", "spine4"}, {"head", "skullbase"}, {"*_hip", "*_hip"}, {"*_knee", "*_knee"},
        {"*_ankle", "*_ankle"}, {"*_foot", "*_forefoot"}, {"*_collar", "*_sternoclavicular"},
        {"*_shoulder", "*_shoulder"}, {"*_elbow", "*_elbow"}, {"*_wrist", "*_wrist"}},
       Fingers("*_{}{}", {"index", "middle", "pinky", "ring", "thumb"}, {"1", "2", "3"}),
       {}},
      {"SmartBody, biped names", "L", "R",
       {{"pelvis", "Hip"}, {"spine1", "LowerSpine"}, {"spine2", "MiddleSpine"},
        {"spine3", "Chest"}, {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*Thigh"},
        {"*_knee", "*Shin"}, {"*_ankle", "*Foot"}, {"*_foot", "*Toe"}, {"*_collar", "*Clavicle"},
        {"*_shoulder", "*Shoulder"}, {"*_elbow", "*Forearm"}, {"*_wrist", "*Hand"}},
       Fingers("*Finger{}{}", {"1", "2", "4", "3", "0"}, {"", "1", "2"}),
       {}},
      // LeftHand only has the roll of the forearm there, LeftFingerBase the bend of the wrist.
      {"CMU, BVH", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "LowerBack"}, {"spine2", "Spine"}, {"spine3", "Spine1"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*UpLeg"}, {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*FingerBase"}},
       {},
       {"LHipJoint", "RHipJoint", "LowerBack", "LThumb", "RThumb"}},
      // The bone "lradius" ends two thirds down the forearm; "lwrist" is the last third.
      {"CMU, ASF/AMC", "l", "r",
       {{"pelvis", "root"}, {"spine1", "lowerback"}, {"spine2", "upperback"},
        {"spine3", "thorax"}, {"neck", "lowerneck"}, {"head", "head"}, {"*_hip", "*femur"},
        {"*_knee", "*tibia"}, {"*_ankle", "*foot"}, {"*_foot", "*toes"},
        {"*_collar", "*clavicle"}, {"*_shoulder", "*humerus"}, {"*_elbow", "*radius"},
        {"*_wrist", "*hand"}},
       {},
       {}},
      {"ACCAD", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "ToSpine"}, {"spine2", "Spine"}, {"spine3", "Spine1"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*UpLeg"}, {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}},
       {},
       {"ToSpine"},
       0.94},
      {"Mixamo", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine"}, {"spine2", "Spine1"}, {"spine3", "Spine2|Chest"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*UpLeg"}, {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase|*Toe"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}},
       Fingers("*Hand{}{}", {"Index", "Middle", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}, std::nullopt,
       "mixamorig|mixamorig1|mixamorig2|mixamorig3|mixamorig4|mixamorig5|mixamorig6|mixamorig7|"
       "mixamorig8|mixamorig9|mixamorig10|mixamorig11|mixamorig12"},
      {"Poser", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Chest"}, {"spine2", "Chest2"},
        {"spine3", "Chest4|Chest3"}, {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*Hip"},
        {"*_knee", "*Knee"}, {"*_ankle", "*Ankle"}, {"*_foot", "*Toe"}, {"*_collar", "*Collar"},
        {"*_shoulder", "*Shoulder"}, {"*_elbow", "*Elbow"}, {"*_wrist", "*Wrist"}},
       {},
       {}},
      // Two neck joints and five spine joints since version 5.
      {"Unreal Engine", "l", "r",
       {{"pelvis", "pelvis"}, {"spine1", "spine_01"}, {"spine2", "spine_02"},
        {"spine3", "spine_03"}, {"neck", "neck_01"}, {"head", "head"}, {"*_hip", "thigh_*"},
        {"*_knee", "calf_*"}, {"*_ankle", "foot_*"}, {"*_foot", "ball_*"},
        {"*_collar", "clavicle_*"}, {"*_shoulder", "upperarm_*"}, {"*_elbow", "lowerarm_*"},
        {"*_wrist", "hand_*"}},
       Fingers("{}_{}_*", {"index", "middle", "pinky", "ring", "thumb"}, {"01", "02", "03"}),
       {}},
      {"Unreal Engine 5", "l", "r",
       {{"pelvis", "pelvis"}, {"spine1", "spine_01"}, {"spine2", "spine_03"},
        {"spine3", "spine_05"}, {"neck", "neck_01"}, {"head", "head"}, {"*_hip", "thigh_*"},
        {"*_knee", "calf_*"}, {"*_ankle", "foot_*"}, {"*_foot", "ball_*"},
        {"*_collar", "clavicle_*"}, {"*_shoulder", "upperarm_*"}, {"*_elbow", "lowerarm_*"},
        {"*_wrist", "hand_*"}},
       Fingers("{}_{}_*", {"index", "middle", "pinky", "ring", "thumb"}, {"01", "02", "03"}),
       {"spine_04", "spine_05", "neck_02"}},
      // Blender: the meta-rig, and the deform bones of the rig generated from it.
      {"Rigify", "L", "R",
       {{"pelvis", "spine"}, {"spine1", "spine.001"}, {"spine2", "spine.002"},
        {"spine3", "spine.003"}, {"neck", "spine.004"}, {"head", "spine.006|spine.005"},
        {"jaw", "jaw"}, {"*_hip", "thigh.*"}, {"*_knee", "shin.*"}, {"*_ankle", "foot.*"},
        {"*_foot", "toe.*"}, {"*_collar", "shoulder.*"}, {"*_shoulder", "upper_arm.*"},
        {"*_elbow", "forearm.*"}, {"*_wrist", "hand.*"}},
       Fingers("{}.{}.*", {"f_index", "f_middle", "f_pinky", "f_ring", "thumb"},
               {"01", "02", "03"}),
       {"spine.006", "spine.005"}, std::nullopt, "DEF-|ORG-"},
      // Humanoid bones of VRM and Unity; the upper chest is optional there.
      {"VRM, Unity", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine"}, {"spine3", "Chest"}, {"neck", "Neck"},
        {"head", "Head"}, {"jaw", "Jaw"}, {"*_hip", "*UpperLeg"}, {"*_knee", "*LowerLeg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*Toes"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*UpperArm"}, {"*_elbow", "*LowerArm"}, {"*_wrist", "*Hand"},
        {"*_eye", "*Eye"}},
       Fingers("*{}{}", {"Index", "Middle", "Little", "Ring"},
               {"Proximal", "Intermediate", "Distal"},
               {"*ThumbMetacarpal|*ThumbProximal", "*ThumbIntermediate|*ThumbProximal",
                "*ThumbDistal"}),
       {}},
      {"VRM, Unity with upper chest", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine"}, {"spine2", "Chest"}, {"spine3", "UpperChest"},
        {"neck", "Neck"}, {"head", "Head"}, {"jaw", "Jaw"}, {"*_hip", "*UpperLeg"},
        {"*_knee", "*LowerLeg"}, {"*_ankle", "*Foot"}, {"*_foot", "*Toes"},
        {"*_collar", "*Shoulder"}, {"*_shoulder", "*UpperArm"}, {"*_elbow", "*LowerArm"},
        {"*_wrist", "*Hand"}, {"*_eye", "*Eye"}},
       Fingers("*{}{}", {"Index", "Middle", "Little", "Ring"},
               {"Proximal", "Intermediate", "Distal"},
               {"*ThumbMetacarpal|*ThumbProximal", "*ThumbIntermediate|*ThumbProximal",
                "*ThumbDistal"}),
       {}},
      {"VRoid", "L", "R",
       {{"pelvis", "C_Hips"}, {"spine1", "C_Spine"}, {"spine2", "C_Chest"},
        {"spine3", "C_UpperChest"}, {"neck", "C_Neck"}, {"head", "C_Head"},
        {"*_hip", "*_UpperLeg"}, {"*_knee", "*_LowerLeg"}, {"*_ankle", "*_Foot"},
        {"*_foot", "*_ToeBase"}, {"*_collar", "*_Shoulder"}, {"*_shoulder", "*_UpperArm"},
        {"*_elbow", "*_LowerArm"}, {"*_wrist", "*_Hand"}},
       Fingers("*_{}{}", {"Index", "Middle", "Little", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}, std::nullopt, "J_Bip_"},
      // 3ds Max.
      {"Biped", "L", "R",
       {{"pelvis", "Pelvis"}, {"spine1", "Spine"}, {"spine2", "Spine1"}, {"spine3", "Spine2"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "* Thigh"}, {"*_knee", "* Calf"},
        {"*_ankle", "* Foot"}, {"*_foot", "* Toe0"}, {"*_collar", "* Clavicle"},
        {"*_shoulder", "* UpperArm"}, {"*_elbow", "* Forearm"}, {"*_wrist", "* Hand"}},
       Fingers("* Finger{}{}", {"1", "2", "4", "3", "0"}, {"", "1", "2"}),
       {}, std::nullopt, "Bip01|Bip001|Bip02|Bip002"},
      {"Biped, three spine joints and more", "L", "R",
       {{"pelvis", "Pelvis"}, {"spine1", "Spine"}, {"spine2", "Spine1"}, {"spine3", "Spine3"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "* Thigh"}, {"*_knee", "* Calf"},
        {"*_ankle", "* Foot"}, {"*_foot", "* Toe0"}, {"*_collar", "* Clavicle"},
        {"*_shoulder", "* UpperArm"}, {"*_elbow", "* Forearm"}, {"*_wrist", "* Hand"}},
       Fingers("* Finger{}{}", {"1", "2", "4", "3", "0"}, {"", "1", "2"}),
       {"Spine3"}, std::nullopt, "Bip01|Bip001|Bip02|Bip002"},
      // Genesis 3 and 8: each limb has two bones, of which the first bends.
      {"Daz Genesis 8", "l", "r",
       {{"pelvis", "pelvis"}, {"spine1", "abdomenLower"}, {"spine2", "abdomenUpper"},
        {"spine3", "chestUpper"}, {"neck", "neckLower"}, {"head", "head"}, {"jaw", "lowerJaw"},
        {"*_hip", "*ThighBend"}, {"*_knee", "*Shin"}, {"*_ankle", "*Foot"}, {"*_foot", "*Toe"},
        {"*_collar", "*Collar"}, {"*_shoulder", "*ShldrBend"}, {"*_elbow", "*ForearmBend"},
        {"*_wrist", "*Hand"}, {"*_eye", "*Eye"}},
       Fingers("*{}{}", {"Index", "Mid", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}},
      // Genesis and Genesis 2.
      {"Daz Genesis", "l", "r",
       {{"pelvis", "pelvis"}, {"spine1", "abdomen"}, {"spine2", "abdomen2"}, {"spine3", "chest"},
        {"neck", "neck"}, {"head", "head"}, {"*_hip", "*Thigh"}, {"*_knee", "*Shin"},
        {"*_ankle", "*Foot"}, {"*_foot", "*Toe"}, {"*_collar", "*Collar"},
        {"*_shoulder", "*Shldr"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"},
        {"*_eye", "*Eye"}},
       Fingers("*{}{}", {"Index", "Mid", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}},
      {"Daz Genesis 9", "l", "r",
       {{"pelvis", "pelvis"}, {"spine1", "spine1"}, {"spine2", "spine2"}, {"spine3", "spine4"},
        {"neck", "neck1"}, {"head", "head"}, {"jaw", "lowerjaw"}, {"*_hip", "*_thigh"},
        {"*_knee", "*_shin"}, {"*_ankle", "*_foot"}, {"*_foot", "*_toes"},
        {"*_collar", "*_shoulder"}, {"*_shoulder", "*_upperarm"}, {"*_elbow", "*_forearm"},
        {"*_wrist", "*_hand"}, {"*_eye", "*_eye"}},
       Fingers("*_{}{}", {"index", "mid", "pinky", "ring", "thumb"}, {"1", "2", "3"}),
       {}},
      {"Character Creator", "L", "R",
       {{"pelvis", "Hip"}, {"spine1", "Waist"}, {"spine2", "Spine01"}, {"spine3", "Spine02"},
        {"neck", "NeckTwist01"}, {"head", "Head"}, {"jaw", "JawRoot"}, {"*_hip", "*_Thigh"},
        {"*_knee", "*_Calf"}, {"*_ankle", "*_Foot"}, {"*_foot", "*_ToeBase"},
        {"*_collar", "*_Clavicle"}, {"*_shoulder", "*_Upperarm"}, {"*_elbow", "*_Forearm"},
        {"*_wrist", "*_Hand"}, {"*_eye", "*_Eye"}},
       Fingers("*_{}{}", {"Index", "Mid", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}, std::nullopt, "CC_Base_"},
      {"Xsens MVN", "Left", "Right",
       {{"pelvis", "Pelvis"}, {"spine1", "L5"}, {"spine2", "T12"}, {"spine3", "T8"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*UpperLeg"}, {"*_knee", "*LowerLeg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*Toe"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*UpperArm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}},
       {},
       {}},
      // The Newton skeleton of Rokoko Studio.
      {"Rokoko", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine1"}, {"spine2", "Spine2"}, {"spine3", "Spine4"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*Thigh"}, {"*_knee", "*Shin"},
        {"*_ankle", "*Foot"}, {"*_foot", "*Toe"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}},
       Fingers("*Finger{}{}", {"2", "3", "5", "4"}, {"Proximal", "Medial", "Distal"},
               {"*Finger1Metacarpal", "*Finger1Proximal", "*Finger1Distal"}),
       {}},
      {"OptiTrack Motive", "L", "R",
       {{"pelvis", "Hip"}, {"spine1", "Ab"}, {"spine3", "Chest"}, {"neck", "Neck"},
        {"head", "Head"}, {"*_hip", "*Thigh"}, {"*_knee", "*Shin"}, {"*_ankle", "*Foot"},
        {"*_foot", "*Toe"}, {"*_collar", "*Shoulder"}, {"*_shoulder", "*UArm"},
        {"*_elbow", "*FArm"}, {"*_wrist", "*Hand"}},
       Fingers("*{}{}", {"Index", "Middle", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}},
      // Poser, Daz 4 and the "daz-friendly" conversion of CMU's motions.
      {"DAZ, Poser", "l", "r",
       {{"pelvis", "hip"}, {"spine1", "abdomen"}, {"spine3", "chest"}, {"neck", "neck"},
        {"head", "head"}, {"*_hip", "*Thigh"}, {"*_knee", "*Shin"}, {"*_ankle", "*Foot"},
        {"*_foot", "*Toe|*Toes"}, {"*_collar", "*Collar"}, {"*_shoulder", "*Shldr"},
        {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}, {"*_eye", "*Eye"}},
       Fingers("*{}{}", {"Index", "Mid", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}},
      // NVIDIA's; in the longer variant the first joint of a finger is in the palm.
      {"SOMA", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine1"}, {"spine2", "Spine2"}, {"spine3", "Chest"},
        {"neck", "Neck1"}, {"head", "Head"}, {"jaw", "Jaw"}, {"*_hip", "*Leg"},
        {"*_knee", "*Shin"}, {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase"},
        {"*_collar", "*Shoulder"}, {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"},
        {"*_wrist", "*Hand"}, {"*_eye", "*Eye"}},
       Fingers("*Hand{}{}", {"Index", "Middle", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {}},
      {"SOMA, 77 joints", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine1"}, {"spine2", "Spine2"}, {"spine3", "Chest"},
        {"neck", "Neck1"}, {"head", "Head"}, {"jaw", "Jaw"}, {"*_hip", "*Leg"},
        {"*_knee", "*Shin"}, {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase"},
        {"*_collar", "*Shoulder"}, {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"},
        {"*_wrist", "*Hand"}, {"*_eye", "*Eye"}},
       Fingers("*Hand{}{}", {"Index", "Middle", "Pinky", "Ring"}, {"2", "3", "4"},
               {"*HandThumb1", "*HandThumb2", "*HandThumb3"}),
       {"LeftHandIndex4", "LeftHandMiddle4"}},
      // Avatars for VRChat, as generated by the plug-in Cats.
      {"VRChat, Cats", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine"}, {"spine3", "Chest"}, {"neck", "Neck"},
        {"head", "Head"}, {"*_hip", "* leg"}, {"*_knee", "* knee"}, {"*_ankle", "* ankle"},
        {"*_foot", "* toe"}, {"*_collar", "* shoulder"}, {"*_shoulder", "* arm"},
        {"*_elbow", "* elbow"}, {"*_wrist", "* wrist"}, {"*_eye", "*Eye|Eye_#"}},
       Fingers("{}Finger{}_#", {"Index", "Middle", "Little", "Ring"}, {"1", "2", "3"},
               {"Thumb0_#", "Thumb1_#", "Thumb2_#"}),
       {}},
      // HumanIK with a longer spine, as written by Vicon Shogun and Perception Neuron.
      {"HumanIK, four spine joints", "Left", "Right",
       {{"pelvis", "Hips"}, {"spine1", "Spine"}, {"spine2", "Spine1"}, {"spine3", "Spine3"},
        {"neck", "Neck"}, {"head", "Head"}, {"*_hip", "*UpLeg"}, {"*_knee", "*Leg"},
        {"*_ankle", "*Foot"}, {"*_foot", "*ToeBase|*Toe"}, {"*_collar", "*Shoulder"},
        {"*_shoulder", "*Arm"}, {"*_elbow", "*ForeArm"}, {"*_wrist", "*Hand"}},
       Fingers("*Hand{}{}", {"Index", "Middle", "Pinky", "Ring", "Thumb"}, {"1", "2", "3"}),
       {"Spine3"}},
  };
  // clang-format on
  return tables;
}

}  // namespace holdfast
