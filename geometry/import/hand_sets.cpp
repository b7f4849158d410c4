// SPDX-License-Identifier: MIT
#include "geometry/import/hand_sets.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/hand_sequence.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kPoseNumbers = 48;  // a root and 15 joints
constexpr std::string_view kCamera = "a camera's frame (x right, y down, z forward)";
constexpr std::string_view kZWorld = "the file's world, assumed to be z-up";

struct NamedLayout {
  HandLayout layout;
  std::string_view pose, trans, betas;  // names of the arrays; `trans` empty: behind the pose
};

constexpr NamedLayout kSets[] = {
    {{"HO-3D", HandRoot::kWrist, false, "a camera's frame (OpenGL: x right, y up, z backward)",
      UpAxis::kY},
     "handPose",
     "handTrans",
     "handBeta"},
    {{"DexYCB", HandRoot::kWrist, true, kCamera, UpAxis::kMinusY}, "pose_m", "", "betas"},
    {{"OakInk", HandRoot::kWristPlaced, false, kCamera, UpAxis::kMinusY},
     "hand_pose",
     "hand_tsl",
     "hand_shape"},
    {{"TACO", HandRoot::kWristPlaced, false, kZWorld, UpAxis::kZ},
     "hand_pose",
     "hand_trans",
     "hand_shape"},
    {{"EasyMocap (GigaHands)", HandRoot::kOrigin, false, kZWorld, UpAxis::kZ},
     "poses",
     "Th",
     "shapes"},
};
constexpr HandLayout kAngles = {"MANO poses, one array", HandRoot::kWrist, false, kZWorld,
                                UpAxis::kZ};
constexpr HandLayout kCoefficients = {"MANO coefficients, one array (HO-Cap, DexYCB)",
                                      HandRoot::kWrist, true, kZWorld, UpAxis::kZ};

constexpr std::array<std::string_view, 3> kTransforms = {"obj_transf", "obj_pose", "object_pose"};

// Objects of YCB by their number in DexYCB, from 1.
constexpr std::string_view kYcb[] = {"002_master_chef_can",
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

bool IsNumber(std::string_view name) {
  return !name.empty() && name.size() < 9 &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Whether an array may hold `columns` numbers in each frame. A frame without a hand has None.
bool MayHave(const Fields& fields, std::string_view name, std::size_t columns) {
  const auto value = fields.Find(name);
  if (!value) return false;
  if (!value->HoldsNumbers()) return value->Kind() == DataKind::kNone;
  const NpyMember member = value->Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  const std::size_t size = member.array.NumElements();
  return size % columns == 0 && (size == columns || (!shape.empty() && shape.back() == columns));
}

const NamedLayout* LayoutOf(const Fields& fields) {
  for (const NamedLayout& set : kSets) {
    if (!MayHave(fields, set.pose, set.trans.empty() ? kPoseNumbers + 3 : kPoseNumbers)) continue;
    if (!set.trans.empty() && !fields.Has(set.trans)) continue;
    if (set.layout.root == HandRoot::kOrigin && !fields.Has("Rh")) continue;
    return &set;
  }
  return nullptr;
}

std::optional<Fields> DictIn(const Fields& fields, std::string_view name) {
  const auto value = fields.Find(name);
  if (!value || value->Kind() != DataKind::kDict) return std::nullopt;
  return Fields(*value);
}

// The names of {"00001": {...}, ...}, in order; none for other values.
std::vector<std::string> FrameNames(const Fields& fields) {
  std::vector<std::string> names = fields.Names();
  if (!std::ranges::all_of(names, IsNumber)) return {};
  std::ranges::sort(names, NaturalLess);
  return names;
}

// DexYCB stores zeros where the hand is not in the picture, HO-Cap -1 or NaN.
bool IsGap(const Eigen::VectorXd& numbers) {
  if (!numbers.allFinite()) return true;
  return (numbers.array() == numbers[0]).all() && (numbers[0] == 0.0 || numbers[0] == -1.0);
}

// What the meta.yml of DexYCB says of a sequence.
struct SequenceMeta {
  std::optional<Side> side;
  std::vector<int> ycb_ids;
  std::optional<int> grasped;
};

SequenceMeta ReadMeta(const fs::path& frame) {
  SequenceMeta meta;
  std::error_code ignored;
  const fs::path folder = fs::absolute(frame, ignored).parent_path();
  for (const fs::path& path : {folder / "meta.yml", folder.parent_path() / "meta.yml"}) {
    if (!fs::is_regular_file(path, ignored)) continue;
    std::ifstream file(path);
    std::string line, list;
    while (std::getline(file, line)) {
      if (line.starts_with("- ")) {
        const std::string value = line.substr(2);
        if (list == "mano_sides") meta.side = value == "left" ? Side::kLeft : Side::kRight;
        if (list == "ycb_ids" && IsNumber(value)) meta.ycb_ids.push_back(std::stoi(value));
        continue;
      }
      const std::size_t colon = std::min(line.find(": "), line.size());
      list = line.substr(0, line.find(':'));
      if (list != "ycb_grasp_ind" || colon == line.size()) continue;
      if (const std::string value = line.substr(colon + 2); IsNumber(value)) {
        meta.grasped = std::stoi(value);
      }
    }
    break;
  }
  return meta;
}

// Collects the frames of one sequence, file by file.
class HandSetReader {
 public:
  HandSetReader(const fs::path& path, const ParameterOptions& options)
      : options_(options), meta_(ReadMeta(path)) {
    sequence_.path = path;
  }

  // A frame, all frames, or a dict of frames; of one hand, or of both by their names.
  void Add(const Fields& fields) {
    const Fields own = HandIn(fields);
    const std::vector<std::string> frames = FrameNames(own);
    if (frames.empty()) AddFrames(own);
    for (const std::string& frame : frames) AddFrames(own.In(frame));
  }

  ImportedClip Finish() {
    sequence_.layout = set_->layout;
    sequence_.side = DecideSide();
    if (set_->layout.name == "TACO") AddTacosObject();
    const std::string& name = sequence_.object_name;
    if (!name.empty() && sequence_.meshes.empty()) {
      sequence_.meshes = {fmt::format("models/{}/textured_simple.obj", name),
                          fmt::format("models/{}/textured.obj", name)};
    }
    return ClipOfHand(std::move(sequence_), options_);
  }

 private:
  void Note(std::string text) { sequence_.imported.notes.push_back(std::move(text)); }

  Fields HandIn(const Fields& fields) {
    auto right = DictIn(fields, "right"), left = DictIn(fields, "left");
    if (!right && !left) return fields;
    side_ = ChooseHand(right.has_value(), left.has_value(), options_, sequence_.imported);
    std::optional<Fields>& own = *side_ == Side::kRight ? right : left;
    if (own) return *std::move(own);
    throw Error(fields.Where(), fmt::format("has no {} hand", SideName(*side_)),
                "Choose the other one with --hands");
  }

  void AddFrames(const Fields& fields) {
    const NamedLayout* const set = LayoutOf(fields);
    if (set == nullptr || (set_ != nullptr && set != set_)) {
      throw Error(fields.Where(), "holds no hand in the form of the frames before it",
                  "Give the frames of one sequence");
    }
    set_ = set;
    const std::size_t before = sequence_.frames.size();
    AddHand(fields);
    AddObject(fields, sequence_.frames.size() - before);
    TakeBetas(fields, set->betas, sequence_);
    NameUnused(fields);
  }

  Side DecideSide() {
    if (side_) return *side_;
    if (const auto wanted = WantedHand(options_)) return *wanted;
    if (meta_.side) return *meta_.side;
    std::string name = sequence_.path.filename().string();
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    if (name.find("left") != std::string::npos) return Side::kLeft;
    const bool told = name.find("right") != std::string::npos;
    if (!told && set_->layout.name != "HO-3D") {  // which has right hands only
      Note(
          "the file does not state which hand it is: assuming the right hand (--hands lhand "
          "overrides this)");
    }
    return Side::kRight;
  }

  void AddHand(const Fields& fields) {
    const DataValue pose = fields[set_->pose];
    if (!pose.HoldsNumbers()) {
      sequence_.frames.emplace_back();
      return;
    }
    const bool packed = set_->trans.empty();
    const Eigen::MatrixXd rows = ReadFrameRows(pose, packed ? kPoseNumbers + 3 : kPoseNumbers);
    const Eigen::Index frames = rows.cols();
    const Eigen::MatrixXd trans =
        packed ? Eigen::MatrixXd(rows.bottomRows<3>()) : ReadFrameRows(fields[set_->trans], 3);
    RequireFrames(fields.Where(), packed ? set_->pose : set_->trans, trans.cols(), frames);
    Eigen::MatrixXd turns;
    if (set_->layout.root == HandRoot::kOrigin) {
      turns = ReadRotations(fields["Rh"], 1, sequence_.imported, frames);
      RequireFrames(fields.Where(), "Rh", turns.cols(), frames);
    }
    for (Eigen::Index t = 0; t < frames; ++t) {
      if (packed && IsGap(rows.col(t))) {
        sequence_.frames.emplace_back();
        continue;
      }
      HandFrame frame{rows.col(t).head<3>(), rows.col(t).segment<kHandDofs>(3), trans.col(t)};
      if (turns.cols() > 0) {
        frame.turn = turns.col(t);
        frame.orient = LogSO3(ExpSO3(frame.turn) * ExpSO3(frame.orient));
      }
      sequence_.frames.emplace_back(std::move(frame));
    }
  }

  void AddObject(const Fields& fields, std::size_t frames) {
    std::vector<Eigen::Isometry3d>& object = sequence_.object;
    const auto turn = fields.Find("objRot"), place = fields.Find("objTrans");
    if (turn && place && turn->HoldsNumbers() && place->HoldsNumbers()) {  // HO-3D
      Eigen::Isometry3d& pose = object.emplace_back(Eigen::Isometry3d::Identity());
      pose.linear() = ExpSO3(ReadObjectRotations(*turn, sequence_.imported, 1).col(0));
      pose.translation() = ReadFrameRows(*place, 3).col(0);
      if (sequence_.object_name.empty()) sequence_.object_name = TextOf(fields, "objName");
    } else if (const auto transforms = fields.Find(kTransforms)) {
      std::ranges::move(ReadRigidPoses(*transforms), std::back_inserter(object));
    } else if (const auto objects = fields.Find("pose_y"); objects && objects->HoldsNumbers()) {
      AddDexYcbsObject(ReadRigidPoses(*objects), frames);
    }
  }

  // Of all objects on the table, the one that meta.yml says is held.
  void AddDexYcbsObject(const std::vector<Eigen::Isometry3d>& poses, std::size_t frames) {
    const std::size_t count = frames > 0 ? poses.size() / frames : 0;
    if (count == 0 || count * frames != poses.size()) return;
    const bool known = meta_.grasped && static_cast<std::size_t>(*meta_.grasped) < count;
    const std::size_t which = known ? static_cast<std::size_t>(*meta_.grasped) : 0;
    if (!known && count > 1 && sequence_.object.empty()) {
      Note(fmt::format(
          "warning: {} objects in the file: the first is used (meta.yml of the sequence "
          "names the one that is held)",
          count));
    }
    for (std::size_t t = 0; t < frames; ++t) sequence_.object.push_back(poses[t * count + which]);
    if (which >= meta_.ycb_ids.size()) return;
    const int id = meta_.ycb_ids[which];
    if (id >= 1 && id <= static_cast<int>(std::size(kYcb))) sequence_.object_name = kYcb[id - 1];
  }

  // Hand_Poses/.../right_hand.pkl: Object_Poses/.../tool_176.npy, and target_*.npy of the left
  // hand. Meshes are in centimeters.
  void AddTacosObject() {
    std::error_code ignored;
    fs::path folder;
    for (const fs::path& part : fs::absolute(sequence_.path, ignored).parent_path()) {
      folder /= part == "Hand_Poses" ? "Object_Poses" : part;
    }
    const std::string begin = sequence_.side == Side::kRight ? "tool_" : "target_";
    for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
         entry.increment(ignored)) {
      const std::string stem = entry->path().stem().string();
      if (!stem.starts_with(begin) || entry->path().extension() != ".npy") continue;
      const DataFile file(entry->path());
      sequence_.object = ReadRigidPoses(file.Root());
      sequence_.object_name = stem.substr(begin.size());
      sequence_.meshes = {fmt::format("object_models_released/{}_cm.obj", sequence_.object_name)};
      sequence_.mesh_scale = 0.01;
      return;
    }
    Note(fmt::format("there is no {}*.npy in {}: the clip has no object", begin, folder.string()));
  }

  void NameUnused(const Fields& fields) {
    if (!sequence_.imported.dropped.empty()) return;
    std::vector<std::string_view> used = {set_->pose, set_->trans, set_->betas, "Rh", "objRot",
                                          "objTrans", "objName",   "pose_y",    "id"};
    used.insert(used.end(), kTransforms.begin(), kTransforms.end());
    DropUnused(fields, used, sequence_.imported);
  }

  const ParameterOptions& options_;
  SequenceMeta meta_;
  const NamedLayout* set_ = nullptr;
  std::optional<Side> side_;  // if the file has both
  HandSequence sequence_;
};

}  // namespace

bool LooksLikeHandSet(const Fields& fields) {
  if (LayoutOf(fields) != nullptr) return true;
  std::vector<std::string> inside = FrameNames(fields);
  if (inside.empty()) inside = {"right", "left"};
  for (const std::string& name : inside) {
    if (const auto dict = DictIn(fields, name)) return LayoutOf(*dict) != nullptr;
  }
  return false;
}

ImportedClip ImportHandSet(const Fields& fields, const fs::path& path,
                           const ParameterOptions& options) {
  HandSetReader reader(path, options);
  reader.Add(fields);
  return reader.Finish();
}

ImportedClip ImportHandFrames(const std::vector<fs::path>& frames,
                              const ParameterOptions& options) {
  HandSetReader reader(frames.at(0), options);
  for (const fs::path& path : frames) {
    const DataFile file(path);
    reader.Add(Fields(file));
  }
  return reader.Finish();
}

bool LooksLikeHandArray(const DataValue& value) {
  if (value.Kind() != DataKind::kArray) return false;
  const NpyMember member = value.Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  if (shape.size() == 3) return shape[0] == 2 && shape[1] > 0 && shape[2] == kPoseNumbers + 3;
  return shape.size() == 2 && shape[0] > 0 &&
         (shape[1] == kPoseNumbers || shape[1] == kPoseNumbers + 3);
}

ImportedClip ImportHandArray(const DataValue& value, const fs::path& path,
                             const ParameterOptions& options) {
  const NpyMember member = value.Array();
  const bool packed = member.array.shape.back() != kPoseNumbers;
  HandSequence sequence;
  sequence.layout = packed ? kCoefficients : kAngles;
  sequence.path = path;
  const std::vector<double> numbers = member.AsDoubles();
  const auto width = static_cast<Eigen::Index>(member.array.shape.back());
  Eigen::MatrixXd rows =
      Eigen::Map<const Eigen::MatrixXd>(numbers.data(), width, std::ssize(numbers) / width);
  if (member.array.shape.size() == 3) {
    const Eigen::Index frames = rows.cols() / 2;
    const Eigen::MatrixXd halves[] = {rows.leftCols(frames), rows.rightCols(frames)};
    const auto shows = [](const Eigen::MatrixXd& half) {
      return std::ranges::any_of(half.colwise(), [](const auto& row) { return !IsGap(row); });
    };
    sequence.side = ChooseHand(shows(halves[0]), shows(halves[1]), options, sequence.imported);
    rows = halves[sequence.side == Side::kRight ? 0 : 1];
  } else {
    sequence.side = WantedHand(options).value_or(Side::kRight);
  }
  if (!packed) {
    sequence.imported.notes.push_back(
        "warning: the array holds poses only: zero is used for the translation of the hand");
  }
  for (const auto& row : rows.colwise()) {
    if (packed ? IsGap(row) : !row.allFinite()) {
      sequence.frames.emplace_back();
      continue;
    }
    sequence.frames.emplace_back(HandFrame{
        row.head<3>(), row.segment<kHandDofs>(3),
        packed ? Eigen::Vector3d(row.tail<3>()) : Eigen::Vector3d(Eigen::Vector3d::Zero())});
  }
  return ClipOfHand(std::move(sequence), options);
}

}  // namespace holdfast
