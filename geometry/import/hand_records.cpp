// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/hand_sequence.h"
#include "geometry/import/hand_sets.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr HandLayout kH2o = {"H2O", HandRoot::kOrigin, false,
                             "the first frame's camera (x right, y down, z forward)",
                             UpAxis::kMinusY};
constexpr HandLayout kContactPose = {"ContactPose", HandRoot::kOrigin, true, "the object's frame",
                                     UpAxis::kZ};
constexpr HandLayout kOakInk2 = {"OakInk2", HandRoot::kWristPlaced, false, "the world of the set",
                                 UpAxis::kY};

constexpr double kOakInk2Rate = 120.0, kH2oRate = 30.0;
constexpr int kH2oNumbers = 62;  // of a hand: annotated or not, translation, pose, shape
constexpr std::array<std::string_view, 9> kH2oObjects = {
    "", "book", "espresso", "lotion", "spray", "milk", "cocoa", "chips", "cappuccino"};

// All numbers of a text file, which must be `count`.
std::vector<double> NumbersOf(const fs::path& path, std::size_t count) {
  const std::string text = ReadGzipText(path);
  TextScanner words(path.string(), text);
  std::vector<double> numbers;
  while (!words.AtEnd() && numbers.size() <= count) numbers.push_back(words.Number("a number"));
  if (numbers.size() != count) {
    throw Error(path.string(), fmt::format("does not hold {} numbers", count),
                "Give the files of H2O as published");
  }
  return numbers;
}

Eigen::Isometry3d PoseOfNumbers(const double* matrix, const fs::path& path) {
  return PoseOfMatrix(Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(matrix),
                      path.string());
}

// The file of the same frame in another folder of the sequence; empty if there is none.
fs::path Beside(const fs::path& hand_file, const char* folder) {
  const fs::path path = hand_file.parent_path().parent_path() / folder / hand_file.filename();
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) ? path : fs::path();
}

// Camera of a frame in the world; the identity if the set has no such file.
Eigen::Isometry3d CameraOf(const fs::path& hand_file) {
  const fs::path path = Beside(hand_file, "cam_pose");
  if (path.empty()) return Eigen::Isometry3d::Identity();
  return PoseOfNumbers(NumbersOf(path, 16).data(), path);
}

// obj_pose_rt/NNNNNN.txt: the object's number, and its pose in the camera.
void AddH2osObject(const fs::path& hand_file, const Eigen::Isometry3d& world_from_camera,
                   SceneObject& object) {
  const fs::path path = Beside(hand_file, "obj_pose_rt");
  if (path.empty()) {
    object.poses.emplace_back();
    return;
  }
  const std::vector<double> numbers = NumbersOf(path, 17);
  object.poses.emplace_back(world_from_camera * PoseOfNumbers(numbers.data() + 1, path));
  const double number = numbers[0];
  if (number >= 1 && number < static_cast<double>(kH2oObjects.size())) {
    object.name = kH2oObjects[static_cast<std::size_t>(number)];
  }
}

bool IsValid(const DataValue& hand) {
  const auto valid = hand.Find("valid");
  return valid && valid->Kind() == DataKind::kBool && valid->Number() != 0;
}

// Frames that OakInk2 stores by number, in order.
std::vector<std::string> FrameNumbers(const DataValue& frames) {
  std::vector<std::string> names = frames.Names();
  std::ranges::sort(names, NaturalLess);
  return names;
}

}  // namespace

std::vector<fs::path> FindH2oFrames(const fs::path& folder) {
  std::vector<fs::path> frames;
  std::error_code error;
  const fs::path inside = folder / "hand_pose_mano";
  const fs::path& in = fs::is_directory(inside, error) ? inside : folder;
  for (fs::directory_iterator entry(in, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".txt") frames.push_back(entry->path());
  }
  if (in.filename() != "hand_pose_mano") frames.clear();
  std::ranges::sort(frames, [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return frames;
}

ImportedClip ImportH2o(const std::vector<fs::path>& frames, const ParameterOptions& options) {
  HandSequence sequence;
  sequence.layout = kH2o;
  sequence.path = fs::absolute(frames.at(0));
  bool has[2] = {false, false};  // left, right
  std::vector<std::vector<double>> rows;
  for (const fs::path& frame : frames) {
    rows.push_back(NumbersOf(frame, 2 * kH2oNumbers));
    for (const int side : {0, 1}) has[side] = has[side] || rows.back()[side * kH2oNumbers] != 0;
  }
  sequence.side = ChooseHand(has[1], has[0], options, sequence.imported);
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(10);
  const Eigen::Isometry3d camera = CameraOf(sequence.path);
  SceneObject object;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    // The camera may be on the head: all frames are put into that of the first one.
    const Eigen::Isometry3d here = camera.inverse() * CameraOf(fs::absolute(frames[t]));
    AddH2osObject(fs::absolute(frames[t]), here, object);
    const double* const n = rows[t].data() + (sequence.side == Side::kRight ? kH2oNumbers : 0);
    const Eigen::Map<const Eigen::VectorXd> numbers(n, kH2oNumbers);
    if (numbers[0] == 0) {
      sequence.frames.emplace_back();
      continue;
    }
    betas = numbers.tail<10>();
    sequence.frames.emplace_back(HandFrame{
        LogSO3(here.linear() * ExpSO3(numbers.segment<3>(4))), numbers.segment<kHandDofs>(7),
        here * Eigen::Vector3d(numbers.segment<3>(1)), LogSO3(here.linear())});
  }
  sequence.betas = betas;
  sequence.rate_hz = kH2oRate;
  sequence.imported.notes.push_back(
      "the set does not state whether finger angles are complete: taken as complete "
      "(--flat-hand-mean no overrides this)");
  if (ChooseObjectOfHand({std::move(object)}, options, sequence)) {
    sequence.meshes = {fmt::format("object/{0}/{0}.obj", sequence.object_name)};
  }
  return ClipOfHand(std::move(sequence), options);
}

bool LooksLikeContactPose(const DataValue& root) {
  if (root.Kind() != DataKind::kList || root.Size() != 2) return false;
  return std::ranges::all_of(std::array<std::size_t, 2>{0, 1}, [&](std::size_t i) {
    return root[i].Kind() == DataKind::kDict && root[i].Has("valid") &&
           (!IsValid(root[i]) || (root[i].Has("mTc") && root[i].Has("pose")));
  });
}

ImportedClip ImportContactPose(const DataValue& root, const fs::path& path,
                               const ParameterOptions& options) {
  const bool left = IsValid(root[std::size_t{0}]), right = IsValid(root[std::size_t{1}]);
  if (!left && !right) {
    throw Error(path.string(), "has no valid hand", "Give a grasp that was annotated");
  }
  HandSequence sequence;
  sequence.layout = kContactPose;
  sequence.path = fs::absolute(path);
  sequence.side = ChooseHand(right, left, options, sequence.imported);
  const Fields hand(root[std::size_t{sequence.side == Side::kRight ? 1U : 0U}]);
  if (!(sequence.side == Side::kRight ? right : left)) {
    throw Error(path.string(), fmt::format("has no {} hand", SideName(sequence.side)),
                "Choose the other one with --hands");
  }
  const Fields camera = hand.In("mTc");
  const Eigen::Isometry3d model_from_object =
      PoseOfQuaternion(ReadFrameRows(camera["rotation"], 4).col(0),
                       ReadFrameRows(camera["translation"], 3).col(0), camera.Where());
  const Eigen::Isometry3d pose = model_from_object.inverse();
  const std::vector<double> numbers = hand["pose"].Array().AsDoubles();
  if (numbers.size() < 4 || numbers.size() > 3 + kHandDofs) {
    throw Error(hand.Where(), fmt::format("has {} numbers in its pose", numbers.size()),
                "Give the rotation of the root and at most 45 coefficients");
  }
  sequence.frames.emplace_back(
      HandFrame{LogSO3(pose.linear() * ExpSO3(Eigen::Vector3d(numbers.data()))),
                Eigen::Map<const Eigen::VectorXd>(numbers.data() + 3, std::ssize(numbers) - 3),
                pose.translation(), LogSO3(pose.linear())});
  TakeBetas(hand, "betas", sequence);
  sequence.object = {Eigen::Isometry3d::Identity()};
  sequence.object_name = sequence.path.parent_path().filename().string();
  sequence.meshes = {sequence.object_name + ".ply"};
  sequence.imported.notes.push_back("one grasp, in the frame of the object: a clip of one frame");
  return ClipOfHand(std::move(sequence), options);
}

bool LooksLikeOakInk2(const Fields& fields) {
  return fields.Has("obj_transf") && (fields.Has("raw_mano") || fields.Has("raw_smplx"));
}

namespace {

std::vector<std::string> OakInk2Meshes(const std::string& name) {
  return {fmt::format("object_preview/align_ds/{0}/{0}.obj", name),
          fmt::format("object_repair/align_ds/{0}/{0}.obj", name),
          fmt::format("object_raw/align_ds/{0}/{0}.obj", name)};
}

std::vector<SceneObject> ObjectsOfOakInk2(const Fields& fields,
                                          const std::vector<std::string>& frames) {
  std::vector<SceneObject> objects;
  const Fields all = fields.In("obj_transf");
  for (const std::string& name : all.Names()) {
    const Fields poses = all.In(name);
    SceneObject& object = objects.emplace_back(SceneObject{name, {}});
    for (const std::string& frame : frames) {
      const auto pose = poses.Find(frame);
      object.poses.push_back(pose ? std::optional(ReadRigidPoses(*pose).at(0)) : std::nullopt);
    }
  }
  return objects;
}

ImportedClip ImportHandOfOakInk2(const Fields& fields, const fs::path& path,
                                 const ParameterOptions& options) {
  const Fields mano = fields.In("raw_mano");
  const std::vector<std::string> frames = FrameNumbers(fields["raw_mano"]);
  HandSequence sequence;
  sequence.layout = kOakInk2;
  sequence.path = fs::absolute(path);
  const Fields first = mano.In(frames[0]);
  sequence.side =
      ChooseHand(first.Has("rh__tsl"), first.Has("lh__tsl"), options, sequence.imported);
  const std::string prefix = sequence.side == Side::kRight ? "rh__" : "lh__";
  for (const std::string& name : frames) {
    const Fields frame = mano.In(name);
    const auto turns = frame.Find(prefix + "pose_coeffs"), place = frame.Find(prefix + "tsl");
    if (!turns || !place) {
      sequence.frames.emplace_back();
      continue;
    }
    const Eigen::VectorXd pose = ReadQuaternions(*turns, 1 + kJointsPerHand).col(0);
    sequence.frames.emplace_back(
        HandFrame{pose.head<3>(), pose.tail<kHandDofs>(), ReadFrameRows(*place, 3).col(0)});
    TakeBetas(frame, prefix + "betas", sequence);
  }
  sequence.rate_hz = kOakInk2Rate;
  if (ChooseObjectOfHand(ObjectsOfOakInk2(fields, frames), options, sequence)) {
    sequence.meshes = OakInk2Meshes(sequence.object_name);
  }
  return ClipOfHand(std::move(sequence), options);
}

// SMPL-X in quaternions; the legs are not tracked.
ImportedClip ImportBodyOfOakInk2(const Fields& fields, const fs::path& path,
                                 const ParameterOptions& options) {
  struct Part {
    const char* name;
    int begin, joints;
  };
  constexpr Part kBodyParts[] = {{"world_rot", 0, 1},
                                 {"body_pose", 1, kNumBodyJoints - 1},
                                 {"jaw_pose", kNumBodyJoints, 1},
                                 {"leye_pose", kNumBodyJoints + 1, 1},
                                 {"reye_pose", kNumBodyJoints + 2, 1},
                                 {"left_hand_pose", kLeftHandBegin, kJointsPerHand},
                                 {"right_hand_pose", kRightHandBegin, kJointsPerHand}};
  const Fields bodies = fields.In("raw_smplx");
  const std::vector<std::string> frames = FrameNumbers(fields["raw_smplx"]);
  ImportedClip imported;
  Clip& clip = imported.clip;
  clip.pose.assign(frames.size(), JointPose::Zero());
  clip.trans.resize(3, std::ssize(frames));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const Fields body = bodies.In(frames[t]);
    for (const Part& part : kBodyParts) {
      if (options.hands == ImportedHands::kNone && part.begin >= kLeftHandBegin) continue;
      const Eigen::VectorXd turns = ReadQuaternions(body[part.name], part.joints).col(0);
      clip.pose[t].middleCols(part.begin, part.joints) = turns.reshaped(3, part.joints);
    }
    clip.trans.col(static_cast<Eigen::Index>(t)) = ReadFrameRows(body["world_tsl"], 3).col(0);
    if (t > 0) continue;
    if (const auto shape = body.Find("body_shape")) SetBetas(ReadBetas(*shape), imported);
  }
  if (options.hands == ImportedHands::kNone) {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
  }
  imported.format = "OakInk2, body";
  clip.frame_rate = options.source_frame_rate.value_or(kOakInk2Rate);
  imported.conventions.push_back("rotations are quaternions, w first; fingers are complete");
  imported.notes.push_back("the data set does not track legs: they are kept straight");
  const std::optional<SceneObject> object =
      ChooseObject(ObjectsOfOakInk2(fields, frames), WristPaths(clip, *options.body), options.prop,
                   path.string(), imported.notes);
  if (object) {
    PutObject(*object, fs::absolute(path), OakInk2Meshes(object->name), options, imported);
  }
  SettleWorld(imported, options, UpAxis::kY, false);
  return imported;
}

}  // namespace

ImportedClip ImportOakInk2(const Fields& fields, const fs::path& path,
                           const ParameterOptions& options) {
  const bool alone = options.hands == ImportedHands::kRightAlone ||
                     options.hands == ImportedHands::kLeftAlone || options.body->LoneHand() ||
                     !fields.Has("raw_smplx");
  const DataValue frames = fields[alone ? "raw_mano" : "raw_smplx"];
  if (frames.Kind() != DataKind::kDict || frames.Names().empty()) {
    throw Error(frames.Where(), "has no frames", "Give an annotation of OakInk2 (anno_preview)");
  }
  ImportedClip imported = alone ? ImportHandOfOakInk2(fields, path, options)
                                : ImportBodyOfOakInk2(fields, path, options);
  constexpr std::array<std::string_view, 5> kUsed = {"raw_mano", "raw_smplx", "obj_transf",
                                                     "obj_list", "mocap_frame_id_list"};
  DropUnused(fields, kUsed, imported);
  return imported;
}

}  // namespace holdfast
