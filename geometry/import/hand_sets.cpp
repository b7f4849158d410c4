// SPDX-License-Identifier: MIT
#include "geometry/import/hand_sets.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include "geometry/body/default_hand.h"
#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// What a root rotates about, and what the translation is.
enum class HandRoot {
  kWrist,        // MANO: x = R (v - J_0) + J_0 + t
  kWristPlaced,  // manopth with center_idx = 0: t is the position of the wrist
  kOrigin,       // EasyMocap: x = R v + t
};

struct HandSet {
  std::string_view name;
  std::string_view pose, trans, betas;  // names of the arrays; `trans` empty: behind the pose
  HandRoot root;
  bool coefficients;  // 45 principal components on top of the mean hand, else complete angles
  std::string_view frame;
  UpAxis up;
};

constexpr std::string_view kCamera = "a camera's frame (x right, y down, z forward)";
constexpr HandSet kSets[] = {
    {"HO-3D", "handPose", "handTrans", "handBeta", HandRoot::kWrist, false,
     "a camera's frame (OpenGL: x right, y up, z backward)", UpAxis::kY},
    {"DexYCB", "pose_m", "", "betas", HandRoot::kWrist, true, kCamera, UpAxis::kMinusY},
    {"OakInk", "hand_pose", "hand_tsl", "hand_shape", HandRoot::kWristPlaced, false, kCamera,
     UpAxis::kMinusY},
    {"TACO", "hand_pose", "hand_trans", "hand_shape", HandRoot::kWristPlaced, false,
     "the set's world, assumed to be z-up", UpAxis::kZ},
    {"EasyMocap (GigaHands)", "poses", "Th", "shapes", HandRoot::kOrigin, false,
     "the cameras' common frame, assumed to be z-up", UpAxis::kZ},
};
constexpr int kPoseNumbers = 48;  // a root and 15 joints
// Arrays without names.
constexpr HandSet kAngles = {"MANO poses, one array",
                             "",
                             "",
                             "",
                             HandRoot::kWrist,
                             false,
                             "the file's world, assumed to be z-up",
                             UpAxis::kZ};
constexpr HandSet kHot3d = {
    "HOT3D", "", "", "", HandRoot::kWrist, true, "the world of the headset, z up", UpAxis::kZ};
constexpr HandSet kCoefficients = {
    "HO-Cap, DexYCB: MANO coefficients, one array", "",        "", "", HandRoot::kWrist, true,
    "the file's world, assumed to be z-up",         UpAxis::kZ};

constexpr std::array<std::string_view, 2> kSideNames = {"right", "left"};

// Whether an array may hold `columns` numbers in each frame. Frames without a hand have None.
bool MayHave(const Fields& fields, std::string_view name, std::size_t columns) {
  const auto value = fields.Find(name);
  if (!value) return false;
  if (!value->HoldsNumbers()) return value->Kind() == DataKind::kNone;
  const std::size_t size = value->Array().array.NumElements();
  const std::vector<std::size_t>& shape = value->Array().array.shape;
  return size % columns == 0 && (size == columns || (!shape.empty() && shape.back() == columns));
}

const HandSet* SetOf(const Fields& fields) {
  for (const HandSet& set : kSets) {
    const std::size_t numbers = set.trans.empty() ? kPoseNumbers + 3 : kPoseNumbers;
    if (!MayHave(fields, set.pose, numbers)) continue;
    if (!set.trans.empty() && !fields.Has(set.trans)) continue;
    if (set.root == HandRoot::kOrigin && !fields.Has("Rh")) continue;
    return &set;
  }
  return nullptr;
}

bool IsNumber(const std::string& name) {
  return !name.empty() &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) != 0; });
}

// The dict of one frame that stands for all in {"00001": {...}, ...}.
std::optional<Fields> FirstFrame(const Fields& fields) {
  const std::vector<std::string> names = fields.Names();
  if (names.empty() || !std::ranges::all_of(names, IsNumber)) return std::nullopt;
  try {
    return fields.In(names[0]);
  } catch (const Error&) {
    return std::nullopt;  // not a dict
  }
}

// {"left": {...}, "right": {...}}: both hands of one sequence.
bool HasSides(const Fields& fields) {
  for (const std::string_view side : kSideNames) {
    if (!fields.Has(side)) continue;
    try {
      if (SetOf(fields.In(side)) != nullptr) return true;
    } catch (const Error&) {
      continue;
    }
  }
  return false;
}

// What the meta.yml of DexYCB and HO-Cap says of a sequence; read line by line.
struct SequenceMeta {
  std::optional<Side> side;
  std::vector<int> ycb_ids;
  int grasped = -1;
};

SequenceMeta ReadMeta(const fs::path& frame) {
  SequenceMeta meta;
  std::error_code ignored;
  const fs::path folder = fs::absolute(frame, ignored).parent_path();
  for (const fs::path& at : {folder, folder.parent_path()}) {
    for (const char* name : {"meta.yml", "meta.yaml"}) {
      if (!fs::is_regular_file(at / name, ignored)) continue;
      std::ifstream file(at / name);
      std::string line, list;
      while (std::getline(file, line) && line.size() < 4096) {
        const std::size_t item = line.find("- ");
        if (item != std::string::npos && line.find_first_not_of(' ') == item) {
          const std::string value = line.substr(item + 2);
          if (list == "mano_sides") meta.side = value == "left" ? Side::kLeft : Side::kRight;
          if (list == "ycb_ids" && IsNumber(value)) meta.ycb_ids.push_back(std::stoi(value));
          continue;
        }
        list = line.substr(0, line.find(':'));
        const std::string prefix = "ycb_grasp_ind: ";
        if (line.starts_with(prefix) && IsNumber(line.substr(prefix.size()))) {
          meta.grasped = std::stoi(line.substr(prefix.size()));
        }
      }
      return meta;
    }
  }
  return meta;
}

// Names of the objects of YCB by their number in DexYCB, from 1.
constexpr std::array<std::string_view, 21> kYcb = {"002_master_chef_can",
                                                   "003_cracker_box",
                                                   "004_sugar_box",
                                                   "005_tomato_soup_can",
                                                   "006_mustard_bottle",
                                                   "007_tuna_fish_can",
                                                   "008_pudding_box",
                                                   "009_gelatin_box",
                                                   "010_potted_meat_can",
                                                   "011_banana",
                                                   "019_pitcher_base",
                                                   "021_bleach_cleanser",
                                                   "024_bowl",
                                                   "025_mug",
                                                   "035_power_drill",
                                                   "036_wood_block",
                                                   "037_scissors",
                                                   "040_large_marker",
                                                   "051_large_clamp",
                                                   "052_extra_large_clamp",
                                                   "061_foam_brick"};

// Collects the frames of one sequence.
class HandSetCollector {
 public:
  HandSetCollector(const fs::path& path, const ParameterOptions& options)
      : path_(path), options_(options), meta_(ReadMeta(path)) {}

  // Appends all frames of a file.
  void Add(const Fields& fields) {
    if (HasSides(fields)) {
      const Side side = WantedSide().value_or(fields.Has("right") ? Side::kRight : Side::kLeft);
      if (fields.Has(kSideNames[0]) && fields.Has(kSideNames[1])) {
        Note(fmt::format("the file has both hands: the {} one is used (--hands rhand or lhand)",
                         SideName(side)));
      }
      side_ = side;
      return Add(fields.In(kSideNames[side == Side::kRight ? 0 : 1]));
    }
    if (FirstFrame(fields)) {
      std::vector<std::string> names = fields.Names();
      std::ranges::sort(names, NaturalLess);
      for (const std::string& name : names) Add(fields.In(name));
      return;
    }
    const HandSet* const set = SetOf(fields);
    if (set == nullptr || (set_ != nullptr && set != set_)) {
      throw Error(fields.Where(), "holds no hand in the form of the frames before it",
                  "Give the frames of one sequence");
    }
    set_ = set;
    AddHand(fields);
    AddObject(fields);
    if (betas_.size() == 0 && fields.Has(set->betas) && fields[set->betas].HoldsNumbers()) {
      const Eigen::MatrixXd betas = ReadBetas(fields[set->betas]);
      if (betas.cols() > 0) betas_ = betas.rowwise().mean();
    }
    NameUnused(fields);
  }

  // One {"timestamp_ns": ..., "hand_poses": {"0": {"pose", "wrist_xform", "betas"}, ...}} per
  // frame.
  void AddHot3d(const DataValue& root) {
    set_ = &kHot3d;
    side_ = WantedSide().value_or(Side::kRight);
    const std::string_view key = *side_ == Side::kRight ? "1" : "0";
    std::vector<double> times;
    bool other = false;
    for (std::size_t t = 0; t < root.Size(); ++t) {
      const Fields frame(root[t]);
      times.push_back(frame["timestamp_ns"].Number());
      const Fields hands = frame.In("hand_poses");
      other = other || hands.Has(key == "1" ? "0" : "1");
      if (!hands.Has(key)) {
        AddGap();
        continue;
      }
      const Fields hand = hands.In(key), wrist = hand.In("wrist_xform");
      if (!hand.Has("pose")) {
        throw Error(hand.Where(), "holds joint angles of UmeTrack's hand, not of MANO",
                    "Give mano_hand_pose_trajectory.jsonl");
      }
      const std::vector<double> fingers = hand["pose"].Array().AsDoubles();
      const Eigen::Vector4d q = ReadFrameRows(wrist["q_wxyz"], 4).col(0);
      if (!(q.norm() > 0.5 && q.norm() < 2.0)) {
        throw Error(wrist.Where(), "has no rotation", "Give a quaternion of length 1, w first");
      }
      Eigen::VectorXd numbers(3 + static_cast<Eigen::Index>(fingers.size()));
      const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
      numbers << LogSO3(turn.normalized().toRotationMatrix()),
          Eigen::Map<const Eigen::VectorXd>(fingers.data(), numbers.size() - 3);
      if (!poses_.empty() && numbers.size() != PoseSize(numbers.size())) {
        throw Error(hand.Where(), "has another number of coefficients than the frames before it",
                    "Check the file");
      }
      poses_.emplace_back(std::move(numbers));
      trans_.emplace_back(ReadFrameRows(wrist["t_xyz"], 3).col(0));
      if (betas_.size() == 0 && hand.Has("betas")) betas_ = ReadBetas(hand["betas"]).col(0);
    }
    if (other) {
      Note(fmt::format("the file has both hands: the {} one is used (--hands rhand or lhand)",
                       SideName(*side_)));
    }
    if (times.size() > 1) {
      const double seconds = 1e-9 * (times.back() - times.front());
      const double rate = static_cast<double>(times.size() - 1) / seconds;
      if (rate >= 1.0 && rate <= 10000.0) rate_ = std::round(rate);
    }
    AddDynamicObjects(times);
  }

  // (T, 48), (T, 51) or (2, T, 51).
  void AddArray(const DataValue& value) {
    const NpyMember member = value.Array();
    const std::vector<std::size_t>& shape = member.array.shape;
    const auto width = static_cast<Eigen::Index>(shape.back());
    set_ = width == kPoseNumbers ? &kAngles : &kCoefficients;
    const std::vector<double> all = member.AsDoubles();
    Eigen::MatrixXd rows = Eigen::Map<const Eigen::MatrixXd>(
        all.data(), width, static_cast<Eigen::Index>(all.size()) / width);
    if (shape.size() == 3) {
      side_ = WantedSide().value_or(Side::kRight);
      Note(fmt::format(
          "the array has the right and the left hand: the {} one is used (--hands rhand "
          "or lhand)",
          SideName(*side_)));
      const Eigen::Index frames = rows.cols() / 2;
      rows = (*side_ == Side::kRight ? rows.leftCols(frames) : rows.rightCols(frames)).eval();
    }
    if (width == kPoseNumbers) {
      Note("warning: the array holds poses only: no translation of the hand");
    }
    for (Eigen::Index t = 0; t < rows.cols(); ++t) {
      if (width > kPoseNumbers ? IsGap(rows.col(t)) : !rows.col(t).allFinite()) {
        AddGap();
        continue;
      }
      poses_.emplace_back(rows.col(t).head(kPoseNumbers));
      trans_.emplace_back(width > kPoseNumbers ? Eigen::Vector3d(rows.col(t).tail<3>())
                                               : Eigen::Vector3d::Zero());
    }
  }

  ImportedClip Collect() {
    const Side side = DecideSide();
    FillGaps();
    Clip& clip = imported_.clip;
    const auto frames = static_cast<Eigen::Index>(poses_.size());
    clip.surface_model_type = "mano";
    clip.pose.assign(poses_.size(), JointPose::Zero());
    clip.trans.resize(3, frames);
    if (betas_.size() > 0) SetBetas(betas_, imported_);
    const auto finger_numbers = poses_[0]->size() - 3;
    Eigen::MatrixXd numbers(3 + finger_numbers, frames);
    for (Eigen::Index t = 0; t < frames; ++t) numbers.col(t) = *poses_[t];
    FingerAngles fingers(options_);
    const bool relaxed = options_.hands == ImportedHands::kNone;
    const Eigen::MatrixXd angles =
        relaxed ? fingers.OfAngles(Eigen::MatrixXd::Zero(kHandDofs, frames), side)
        : set_->coefficients
            ? fingers.OfCoefficients(numbers.bottomRows(finger_numbers), side, path_.string())
            : fingers.OfAngles(numbers.bottomRows(finger_numbers), side);
    SetJoints(clip.pose, HandBegin(side), angles, path_.string());
    SetJoints(clip.pose, 0, numbers.topRows<3>(), path_.string());
    const bool complete = options_.flat_hand_mean.value_or(!set_->coefficients);
    if (relaxed || !complete) fingers.AddMean(clip.pose);
    const std::shared_ptr<const BodyModel> hand =
        options_.body->LoneHand() ? options_.body : DefaultHand(side);
    const Eigen::Vector3d wrist = PelvisOf(clip, *hand);
    for (Eigen::Index t = 0; t < frames; ++t) {
      Eigen::Vector3d trans = trans_[t];
      if (set_->root == HandRoot::kWristPlaced) trans -= wrist;
      if (set_->root == HandRoot::kOrigin) {
        trans += ExpSO3(turns_[t]) * wrist - wrist;
      }
      clip.trans.col(t) = trans;
    }
    if (set_->name == "TACO") AddTacoObject(side);
    PutObject();
    imported_.format = fmt::format("{}, {} hand", set_->name, SideName(side));
    imported_.conventions.push_back(fmt::format("positions are in {}", set_->frame));
    Append(imported_.conventions, fingers.Conventions());
    Append(imported_.notes, fingers.Notes());
    clip.frame_rate = options_.source_frame_rate.value_or(rate_.value_or(30.0));
    if (frames > 1 && !options_.source_frame_rate && !rate_) {
      Note(
          "warning: no frame rate in the file: assuming 30 Hz ('holdfast import --source-fps' "
          "overrides this)");
    }
    SettleWorld(imported_, options_, set_->up, false);
    return std::move(imported_);
  }

 private:
  void Note(std::string text) { imported_.notes.push_back(std::move(text)); }

  std::optional<Side> WantedSide() const {
    if (options_.hands == ImportedHands::kLeftAlone) return Side::kLeft;
    if (options_.hands == ImportedHands::kRightAlone) return Side::kRight;
    return options_.body->LoneHand();
  }

  Side DecideSide() {
    if (side_) return *side_;
    if (const auto wanted = WantedSide()) return *wanted;
    if (meta_.side) return *meta_.side;
    std::string name = path_.filename().string();
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    if (name.find("left") != std::string::npos) return Side::kLeft;
    // HO-3D has right hands only.
    if (name.find("right") == std::string::npos && set_->name != "HO-3D") {
      Note(
          "the file does not state which hand it is: assuming the right hand (--hands lhand "
          "overrides this)");
    }
    return Side::kRight;
  }

  void AddGap() {
    poses_.push_back(std::nullopt);
    trans_.emplace_back(0.0, 0.0, 0.0);
  }

  void AddHand(const Fields& fields) {
    const DataValue pose = fields[set_->pose];
    if (!pose.HoldsNumbers()) return AddGap();
    const bool packed = set_->trans.empty();
    const Eigen::MatrixXd rows = ReadFrameRows(pose, packed ? kPoseNumbers + 3 : kPoseNumbers);
    const Eigen::Index frames = rows.cols();
    Eigen::MatrixXd trans =
        packed ? Eigen::MatrixXd(rows.bottomRows<3>()) : ReadFrameRows(fields[set_->trans], 3);
    RequireFrames(fields.Where(), packed ? set_->pose : set_->trans, trans.cols(), frames);
    Eigen::MatrixXd turned;
    if (set_->root == HandRoot::kOrigin) {
      turned = ReadRotations(fields["Rh"], 1, imported_, frames);
      RequireFrames(fields.Where(), "Rh", turned.cols(), frames);
    }
    for (Eigen::Index t = 0; t < frames; ++t) {
      Eigen::VectorXd numbers = rows.col(t).head(kPoseNumbers);
      if (packed && IsGap(rows.col(t))) {
        AddGap();
        continue;
      }
      if (turned.cols() > 0) {
        turns_.emplace_back(turned.col(t));
        numbers.head<3>() = LogSO3(ExpSO3(turned.col(t)) * ExpSO3(numbers.head<3>()));
      }
      poses_.emplace_back(std::move(numbers));
      trans_.emplace_back(trans.col(t));
    }
  }

  // DexYCB stores zeros where the hand is not in the picture, HO-Cap -1 or NaN.
  static bool IsGap(const Eigen::VectorXd& numbers) {
    if (!numbers.allFinite()) return true;
    return (numbers.array() == numbers[0]).all() && (numbers[0] == 0.0 || numbers[0] == -1.0);
  }

  // Poses of an object in row-major matrices (3 x 4, 4 x 4), or as (x, y, z, w) and a position.
  static std::vector<Eigen::Isometry3d> PosesIn(const DataValue& value) {
    const NpyMember member = value.Array();
    const std::vector<std::size_t>& shape = member.array.shape;
    const std::vector<double> numbers = member.AsDoubles();
    const bool matrices = shape.size() >= 2 && shape.back() == 4 &&
                          (shape[shape.size() - 2] == 3 || shape[shape.size() - 2] == 4);
    const bool quaternions = !shape.empty() && shape.back() == 7;
    if (!matrices && !quaternions) {
      throw Error(
          value.Where(),
          fmt::format("has shape {}, which is not that of rigid poses", member.ShapeText()),
          "Give matrices (..., 3, 4) or (..., 4, 4), or (..., 7): x, y, z, w and a position");
    }
    const std::size_t size = quaternions ? 7 : 4 * shape[shape.size() - 2];
    std::vector<Eigen::Isometry3d> poses;
    for (std::size_t at = 0; at + size <= numbers.size(); at += size) {
      const double* const n = numbers.data() + at;
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      if (quaternions) {
        Eigen::Quaterniond turn(n[3], n[0], n[1], n[2]);
        pose.linear() =
            turn.norm() > 0.0 ? turn.normalized().toRotationMatrix() : Eigen::Matrix3d::Identity();
        pose.translation() = Eigen::Vector3d(n[4], n[5], n[6]);
      } else {
        const Eigen::Matrix<double, 3, 4> rows =
            Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(n);
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rows.leftCols<3>(),
                                                    Eigen::ComputeFullU | Eigen::ComputeFullV);
        if (svd.singularValues()[2] < 0.5 || svd.singularValues()[0] > 2.0) {
          throw Error(value.Where(), fmt::format("has no rotation in pose {}", poses.size()),
                      "Give rotation matrices of determinant 1");
        }
        pose.linear() = svd.matrixU() * svd.matrixV().transpose();
        pose.translation() = rows.col(3);
      }
      poses.push_back(pose);
    }
    return poses;
  }

  void AddObject(const Fields& fields) {
    const std::size_t frames = poses_.size();
    if (fields.Has("objRot") && fields.Has("objTrans") && fields["objRot"].HoldsNumbers()) {
      const Eigen::MatrixXd turns = ReadObjectRotations(fields["objRot"], imported_, 1);
      const Eigen::MatrixXd places = ReadFrameRows(fields["objTrans"], 3);
      for (Eigen::Index t = 0; t < std::min(turns.cols(), places.cols()); ++t) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.linear() = ExpSO3(turns.col(t));
        pose.translation() = places.col(t);
        object_.push_back(pose);
      }
      if (object_name_.empty()) object_name_ = TextOf(fields, "objName");
    } else if (const auto transforms = fields.Find(kTransforms)) {
      for (const Eigen::Isometry3d& pose : PosesIn(*transforms)) object_.push_back(pose);
    } else if (const auto objects = fields.Find("pose_y"); objects && objects->HoldsNumbers()) {
      const std::vector<Eigen::Isometry3d> poses = PosesIn(*objects);
      const std::size_t added = frames - object_.size();
      const std::size_t count = added > 0 ? poses.size() / added : 0;
      if (count == 0 || count * added != poses.size()) return;
      std::size_t which = 0;
      if (meta_.grasped >= 0 && static_cast<std::size_t>(meta_.grasped) < count) {
        which = static_cast<std::size_t>(meta_.grasped);
      } else if (count > 1 && !warned_of_objects_) {
        Note(
            fmt::format("warning: {} objects in the file: the first is used (meta.yml of the "
                        "sequence names the one that is held)",
                        count));
        warned_of_objects_ = true;
      }
      for (std::size_t t = 0; t < added; ++t) object_.push_back(poses[t * count + which]);
      if (which < meta_.ycb_ids.size()) {
        const int id = meta_.ycb_ids[which];
        if (id >= 1 && id <= static_cast<int>(kYcb.size())) object_name_ = kYcb[id - 1];
      }
    }
  }

  // Numbers of the frames before, or `otherwise` if all were gaps.
  Eigen::Index PoseSize(Eigen::Index otherwise) const {
    for (const auto& pose : poses_) {
      if (pose) return pose->size();
    }
    return otherwise;
  }

  // dynamic_objects.csv: a line for each object and time, with its position and quaternion.
  void AddDynamicObjects(const std::vector<double>& times) {
    std::error_code ignored;
    fs::path csv;
    const fs::path folder = fs::absolute(path_, ignored).parent_path();
    for (const fs::path& at : {folder, folder.parent_path() / "ground_truth"}) {
      if (csv.empty() && fs::is_regular_file(at / "dynamic_objects.csv", ignored)) {
        csv = at / "dynamic_objects.csv";
      }
    }
    if (csv.empty()) return Note("no dynamic_objects.csv beside the file: no object");
    std::map<std::string, std::map<std::int64_t, Eigen::Isometry3d>> tracks;
    const std::string text = ReadGzipText(csv);
    std::size_t number = 0;
    for (std::size_t at = 0; at < text.size(); ++number) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::vector<std::string_view> cells;
      for (std::size_t begin = at; begin <= end;) {
        const std::size_t comma = std::min(text.find(',', begin), end);
        cells.push_back(std::string_view(text).substr(begin, comma - begin));
        begin = comma + 1;
      }
      at = end + 1;
      double n[8] = {};
      bool good = cells.size() >= 9;
      for (std::size_t k = 0; good && k < 8; ++k) good = ParseNumber(cells[k + 1], n[k]);
      if (!good) {
        if (number == 0 || cells.size() < 2) continue;  // the header, an empty line
        throw Error(fmt::format("{}:{}", csv.string(), number + 1), "is not an object's pose",
                    "Give object_uid, timestamp[ns], three numbers of the position, four of the "
                    "quaternion, w first");
      }
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = Eigen::Quaterniond(n[4], n[5], n[6], n[7]).normalized().toRotationMatrix();
      pose.translation() = Eigen::Vector3d(n[1], n[2], n[3]);
      tracks[std::string(cells[0])][static_cast<std::int64_t>(n[0])] = pose;
    }
    // The object whose origin comes nearest to the wrist, on average.
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [uid, poses] : tracks) {
      double sum = 0.0;
      int count = 0;
      for (std::size_t t = 0; t < times.size(); ++t) {
        const auto found = poses.find(static_cast<std::int64_t>(times[t]));
        if (!poses_[t] || found == poses.end()) continue;
        sum += (found->second.translation() - trans_[t]).norm();
        ++count;
      }
      if (count == 0 || sum / count >= least) continue;
      least = sum / count;
      object_name_ = uid;
    }
    if (object_name_.empty()) return Note("dynamic_objects.csv has no object at the file's times");
    if (tracks.size() > 1) {
      Note(fmt::format("{} objects beside the file: {} is used, which is nearest to the hand",
                       tracks.size(), object_name_));
    }
    const auto& poses = tracks[object_name_];
    int missing = 0;
    for (const double time : times) {
      const auto found = poses.find(static_cast<std::int64_t>(time));
      missing += found == poses.end();
      auto nearest =
          found != poses.end() ? found : poses.lower_bound(static_cast<std::int64_t>(time));
      if (nearest == poses.end()) nearest = std::prev(poses.end());
      object_.push_back(nearest->second);
    }
    if (missing > 0) {
      Note(fmt::format("warning: no pose of the object in {} of {} frames: the next one is used",
                       missing, times.size()));
    }
  }

  // TACO's right hand uses the tool, its left hand holds the target; meshes are in centimeters.
  void AddTacoObject(Side side) {
    std::error_code ignored;
    fs::path folder;
    bool moved = false;
    for (const fs::path& part : fs::absolute(path_, ignored).parent_path()) {
      folder /= part == "Hand_Poses" ? "Object_Poses" : part;
      moved = moved || part == "Hand_Poses";
    }
    const std::string begins = side == Side::kRight ? "tool_" : "target_";
    for (fs::directory_iterator entry(folder, ignored), end; moved && !ignored && entry != end;
         entry.increment(ignored)) {
      const std::string stem = entry->path().stem().string();
      if (!stem.starts_with(begins) || entry->path().extension() != ".npy") continue;
      const DataFile file(entry->path());
      object_ = PosesIn(file.Root());
      object_name_ = stem.substr(begins.size());
      imported_.object_mesh = FindInDataSet(
          path_, fmt::format("object_models_released/{}_cm.obj", object_name_), options_);
      imported_.object_mesh_scale = 0.01;
      Note(fmt::format("the object is the {} of Object_Poses", stem.substr(0, begins.size() - 1)));
      return;
    }
    Note("no Object_Poses beside Hand_Poses: no object");
  }

  void FillGaps() {
    std::vector<int> with, without;
    for (int t = 0; t < static_cast<int>(poses_.size()); ++t) {
      (poses_[t] ? with : without).push_back(t);
    }
    if (with.empty()) {
      throw Error(path_.string(), "has no frame with a hand",
                  "Give frames in which the hand was annotated");
    }
    if (without.empty()) return;
    for (const int t : without) {
      const int nearest =
          *std::ranges::min_element(with, {}, [&](int other) { return std::abs(other - t); });
      poses_[t] = poses_[nearest];
      trans_[t] = trans_[nearest];
    }
    constexpr std::size_t kNamed = 8;
    const bool more = without.size() > kNamed;
    const std::size_t count = without.size();
    if (more) without.resize(kNamed);
    Note(fmt::format("warning: no hand in {} of {} frames ({}{}): the nearest hand is kept there",
                     count, poses_.size(), fmt::join(without, ", "), more ? ", ..." : ""));
  }

  void PutObject() {
    if (object_.empty()) return;
    if (object_.size() == 1) object_.resize(poses_.size(), object_[0]);
    RequireFrames(path_.string(), "the object", static_cast<Eigen::Index>(object_.size()),
                  static_cast<Eigen::Index>(poses_.size()));
    ObjectTrack track;
    track.name = object_name_.empty() ? "object" : object_name_;
    track.trans.resize(3, static_cast<Eigen::Index>(object_.size()));
    track.orient.resize(3, track.trans.cols());
    for (Eigen::Index t = 0; t < track.trans.cols(); ++t) {
      track.trans.col(t) = object_[t].translation();
      track.orient.col(t) = LogSO3(object_[t].linear());
    }
    for (const char* file : {"models/{}/textured_simple.obj", "models/{}/textured.obj",
                             "object_models/{}.glb", "assets/{}.glb"}) {
      if (!object_name_.empty() && imported_.object_mesh.empty()) {
        imported_.object_mesh =
            FindInDataSet(path_, fmt::format(fmt::runtime(file), object_name_), options_);
      }
    }
    if (imported_.object_mesh.empty()) {
      Note(
          fmt::format("the mesh of the object{} was not found (give it with --object-mesh, or the "
                      "folder of the data set with --data-root)",
                      object_name_.empty() ? std::string() : " " + object_name_));
    }
    imported_.conventions.push_back("object: x = R x + t");
    imported_.clip.object = std::move(track);
  }

  void NameUnused(const Fields& fields) {
    if (!imported_.dropped.empty()) return;
    std::vector<std::string_view> used = {set_->pose, set_->trans, set_->betas, "Rh", "objRot",
                                          "objTrans", "objName",   "pose_y",    "id"};
    used.insert(used.end(), kTransforms.begin(), kTransforms.end());
    DropUnused(fields, used, imported_);
  }

  static constexpr std::array<std::string_view, 3> kTransforms = {"obj_transf", "obj_pose",
                                                                  "object_pose"};

  fs::path path_;
  const ParameterOptions& options_;
  SequenceMeta meta_;
  const HandSet* set_ = nullptr;
  std::optional<Side> side_;
  std::vector<std::optional<Eigen::VectorXd>> poses_;  // 48 numbers each
  std::vector<Eigen::Vector3d> trans_, turns_;         // turns about the origin, if any
  std::vector<Eigen::Isometry3d> object_;
  Eigen::VectorXd betas_;
  std::string object_name_;
  std::optional<double> rate_;  // Hz, if the file states it
  bool warned_of_objects_ = false;
  ImportedClip imported_;
};

}  // namespace

bool LooksLikeHandSet(const Fields& fields) {
  if (SetOf(fields) != nullptr || HasSides(fields)) return true;
  const std::optional<Fields> first = FirstFrame(fields);
  return first && (SetOf(*first) != nullptr || HasSides(*first));
}

ImportedClip ImportHandSet(const Fields& fields, const fs::path& path,
                           const ParameterOptions& options) {
  HandSetCollector collector(path, options);
  collector.Add(fields);
  return collector.Collect();
}

bool LooksLikeHot3d(const DataValue& root) {
  if (root.Kind() != DataKind::kList || root.Size() == 0) return false;
  const DataValue first = root[std::size_t{0}];
  return first.Kind() == DataKind::kDict && first.Has("hand_poses") && first.Has("timestamp_ns");
}

ImportedClip ImportHot3d(const DataValue& root, const fs::path& path,
                         const ParameterOptions& options) {
  HandSetCollector collector(path, options);
  collector.AddHot3d(root);
  return collector.Collect();
}

bool LooksLikeHandArray(const DataValue& value) {
  if (value.Kind() != DataKind::kArray) return false;
  const std::vector<std::size_t> shape = value.Array().array.shape;
  if (shape.size() == 3) return shape[0] == 2 && shape[1] > 0 && shape[2] == kPoseNumbers + 3;
  return shape.size() == 2 && shape[0] > 0 &&
         (shape[1] == kPoseNumbers || shape[1] == kPoseNumbers + 3);
}

ImportedClip ImportHandArray(const DataValue& value, const fs::path& path,
                             const ParameterOptions& options) {
  HandSetCollector collector(path, options);
  collector.AddArray(value);
  return collector.Collect();
}

ImportedClip ImportHandFrames(const std::vector<fs::path>& frames,
                              const ParameterOptions& options) {
  HandSetCollector collector(frames.at(0), options);
  for (const fs::path& path : frames) {
    const DataFile file(path);
    collector.Add(Fields(file));
  }
  return collector.Collect();
}

}  // namespace holdfast
