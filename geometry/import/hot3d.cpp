// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/hand_sequence.h"
#include "geometry/import/hand_sets.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr HandLayout kHot3d = {"HOT3D", HandRoot::kWrist, true, "the world of the headset, z up",
                               UpAxis::kZ};
constexpr double kMaxTime_ns = 9e15;  // whole numbers are exact below

using Times = std::vector<std::int64_t>;
using Track = std::map<std::int64_t, Eigen::Isometry3d>;

// object_uid, timestamp[ns], position, quaternion with w first; a line of names comes first.
std::map<std::string, Track> ReadTracks(const fs::path& path) {
  const std::string text = ReadGzipText(path);
  std::map<std::string, Track> tracks;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (++number == 1 || line.empty()) continue;
    const std::string where = fmt::format("{}:{}", path.string(), number);
    std::string uid;
    double n[8] = {};
    int cells = 0;
    for (std::size_t begin = 0; begin <= line.size(); ++cells) {
      const std::size_t comma = std::min(line.find(',', begin), line.size());
      const std::string_view cell = line.substr(begin, comma - begin);
      begin = comma + 1;
      if (cells == 0) uid = Excerpt(cell, 64);
      if (cells > 0 && cells <= 8 && !ParseNumber(cell, n[cells - 1])) break;
    }
    if (cells < 9 || !(std::abs(n[0]) < kMaxTime_ns)) {
      throw Error(where, "is not a pose of an object",
                  "Give object_uid, timestamp[ns], three numbers of the position and four of the "
                  "quaternion, w first");
    }
    tracks[uid][static_cast<std::int64_t>(n[0])] =
        PoseOfQuaternion({n[4], n[5], n[6], n[7]}, {n[1], n[2], n[3]}, where);
  }
  return tracks;
}

void AddNearestObject(const Times& times, const ParameterOptions& options, HandSequence& sequence) {
  std::vector<std::string>& notes = sequence.imported.notes;
  std::error_code ignored;
  const fs::path folder = fs::absolute(sequence.path, ignored).parent_path();
  fs::path csv = folder / "dynamic_objects.csv";
  if (!fs::is_regular_file(csv, ignored)) {
    csv = folder.parent_path() / "ground_truth" / "dynamic_objects.csv";
  }
  if (!fs::is_regular_file(csv, ignored)) {
    notes.push_back("there is no dynamic_objects.csv beside the file: the clip has no object");
    return;
  }
  std::vector<SceneObject> objects;
  for (const auto& [uid, track] : ReadTracks(csv)) {
    SceneObject& object = objects.emplace_back(SceneObject{uid, {}});
    for (const std::int64_t time : times) {
      const auto at = track.find(time);
      object.poses.push_back(at == track.end() ? std::nullopt : std::optional(at->second));
    }
  }
  if (!ChooseObjectOfHand(std::move(objects), options, sequence)) return;
  for (const char* folder_of_meshes : {"object_models", "assets"}) {
    sequence.meshes.push_back(fmt::format("{}/{}.glb", folder_of_meshes, sequence.object_name));
  }
}

std::optional<HandFrame> ReadHand(const Fields& hands, const std::string& key) {
  if (!hands.Has(key)) return std::nullopt;
  const Fields hand = hands.In(key);
  if (!hand.Has("pose")) {
    throw Error(hand.Where(), "holds no pose of MANO (UmeTrack's hands have joint_angles)",
                "Give mano_hand_pose_trajectory.jsonl");
  }
  const Fields wrist = hand.In("wrist_xform");
  const Eigen::Isometry3d pose =
      PoseOfQuaternion(ReadFrameRows(wrist["q_wxyz"], 4).col(0),
                       ReadFrameRows(wrist["t_xyz"], 3).col(0), wrist.Where());
  const std::vector<double> fingers = hand["pose"].Array().AsDoubles();
  return HandFrame{LogSO3(pose.linear()),
                   Eigen::Map<const Eigen::VectorXd>(fingers.data(), std::ssize(fingers)),
                   pose.translation()};
}

}  // namespace

bool LooksLikeHot3d(const DataValue& root) {
  if (root.Kind() != DataKind::kList || root.Size() == 0) return false;
  const DataValue first = root[std::size_t{0}];
  return first.Kind() == DataKind::kDict && first.Has("hand_poses") && first.Has("timestamp_ns");
}

ImportedClip ImportHot3d(const DataValue& root, const fs::path& path,
                         const ParameterOptions& options) {
  HandSequence sequence;
  sequence.layout = kHot3d;
  sequence.path = path;
  bool has[2] = {false, false};  // left, right
  for (std::size_t t = 0; t < root.Size(); ++t) {
    const Fields hands = Fields(root[t]).In("hand_poses");
    for (const int side : {0, 1}) has[side] = has[side] || hands.Has(std::to_string(side));
  }
  sequence.side = ChooseHand(has[1], has[0], options, sequence.imported);
  const std::string key = sequence.side == Side::kRight ? "1" : "0";
  Times times;
  for (std::size_t t = 0; t < root.Size(); ++t) {
    const Fields frame(root[t]);
    const double time = frame["timestamp_ns"].Number();
    if (!(std::abs(time) < kMaxTime_ns)) {
      throw Error(frame.Where(), "has an impossible timestamp_ns", "Give nanoseconds");
    }
    times.push_back(static_cast<std::int64_t>(time));
    const Fields hands = frame.In("hand_poses");
    sequence.frames.push_back(ReadHand(hands, key));
    if (sequence.frames.back()) TakeBetas(hands.In(key), "betas", sequence);
  }
  const auto steps = static_cast<double>(times.size() - 1);
  const double rate = steps / (1e-9 * static_cast<double>(times.back() - times.front()));
  if (rate >= 1.0 && rate <= 10'000.0) sequence.rate_hz = std::round(rate);
  AddNearestObject(times, options, sequence);
  return ClipOfHand(std::move(sequence), options);
}

}  // namespace holdfast
