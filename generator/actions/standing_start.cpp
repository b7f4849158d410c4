// SPDX-License-Identifier: MIT
#include "generator/actions/standing_start.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/body/limb_ik.h"
#include "generator/matching/capture_set.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr int kHip = 1, kKnee = 4, kAnkle = 7;  // left; the right is next
constexpr int kMinFrames = 24, kMaxFrames = 150;
constexpr double kStill_m = 0.02;  // maximum drift of an ankle; twice that for the pelvis
constexpr double kIdle_m = 0.10;   // maximum drift of a hand relative to the pelvis

bool Stands(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame) {
  const BodyPlacement at = Place(rest_joints, frame);
  if (at.rotation[0](2, 1) < 0.96 || at.rotation[kSpine3](2, 1) < 0.93) return false;
  if (at.rotation[kHead](2, 1) < 0.93) return false;
  // The face points in the direction of the body.
  const Vector3d forward = at.rotation[0].col(2);
  if (at.rotation[kHead].col(2).head<2>().dot(forward.head<2>()) < 0.85) return false;
  for (const int side : {0, 1}) {
    const Vector3d hip = at.joints.col(kHip + side), ankle = at.joints.col(kAnkle + side);
    const double longest = (rest_joints.col(kHip + side) - rest_joints.col(kKnee + side)).norm() +
                           (rest_joints.col(kKnee + side) - rest_joints.col(kAnkle + side)).norm();
    if ((hip - ankle).norm() < 0.945 * longest || ankle.z() > 0.16) return false;
    const Vector3d wrist = at.joints.col(20 + side), shoulder = at.joints.col(16 + side);
    const Vector3d from_pelvis = wrist - at.joints.col(0);
    if (wrist.z() > at.joints(2, 0) + 0.22 || from_pelvis.head<2>().norm() > 0.48) return false;
    if (from_pelvis.dot(forward) < -0.12 || shoulder.z() < wrist.z()) return false;
  }
  const Vector3d apart = at.joints.col(kAnkle) - at.joints.col(kAnkle + 1);
  return apart.head<2>().norm() > 0.08 && apart.head<2>().norm() < 0.50 &&
         std::abs(apart.z()) < 0.03;
}

// Returns the frame until which feet and pelvis stay in place from `begin` on.
int StillUntil(const Eigen::Matrix3Xd& rest_joints, std::span<const BodyFrame> frames, int begin) {
  const BodyPlacement first = Place(rest_joints, frames[static_cast<std::size_t>(begin)]);
  int t = begin;
  for (; t < std::min<int>(static_cast<int>(frames.size()), begin + kMaxFrames); ++t) {
    const BodyFrame& frame = frames[static_cast<std::size_t>(t)];
    if (!Stands(rest_joints, frame)) break;
    const BodyPlacement at = Place(rest_joints, frame);
    const auto wandered = [&](int joint) {
      return (at.joints.col(joint) - first.joints.col(joint)).norm();
    };
    if (wandered(kAnkle) > kStill_m || wandered(kAnkle + 1) > kStill_m ||
        wandered(0) > 2.0 * kStill_m) {
      break;
    }
    // A gesture is not idle.
    const Vector3d along = at.joints.col(0) - first.joints.col(0);
    const auto gestured = [&](int wrist) {
      return (at.joints.col(wrist) - first.joints.col(wrist) - along).norm();
    };
    if (gestured(20) > kIdle_m || gestured(21) > kIdle_m) break;
  }
  return t;
}

}  // namespace

std::vector<StandingStart> FindStandingStarts(const Eigen::Matrix3Xd& rest_joints,
                                              std::span<const BodyFrame> frames) {
  std::vector<StandingStart> starts;
  const int count = static_cast<int>(frames.size());
  for (int begin = 0; begin + kMinFrames <= count;) {
    const int end = StillUntil(rest_joints, frames, begin);
    if (end - begin < kMinFrames) {
      begin = std::max(end, begin + 3);
      continue;
    }
    StandingStart start;
    start.source_frame = begin;
    const PlanarMove home = AlignHeading(frames[static_cast<std::size_t>(begin)], BodyFrame());
    for (int t = begin; t < end; ++t) {
      start.frames.push_back(home * frames[static_cast<std::size_t>(t)]);
    }
    starts.push_back(std::move(start));
    begin = end;
  }
  return starts;
}

StandingStart OwnStanding(const BodyMeasures& body, std::uint64_t seed) {
  const Limb arm = Arm(Side::kRight);
  const Vector3d shoulder = body.rest_joints.col(arm.root) - body.rest_joints.col(0);
  const double height = body.rest_joints(1, arm.root) - body.sole_y;
  const double reach = MaxReach(body.rest_joints, arm);
  ReachKey hang;
  hang.wrist = Vector3d(shoulder.x() - 0.08, -0.06, height - 0.97 * reach);
  hang.hand = HandOrientation(Side::kRight, -Vector3d::UnitZ(), -Vector3d::UnitY());
  hang.gaze = 0.0;
  ScriptedReachOptions options;
  options.duration_s = kMaxFrames / 30.0;
  options.seed = seed;
  StandingStart start;
  start.source = "own";
  start.frames = BodyFrames(MakeReachMotion(body, {hang}, options), body.rest_joints);
  return start;
}

std::vector<BodyFrame> IdleMotion(const BodyMeasures& body, const StandingStart& start, int count) {
  const int last = static_cast<int>(start.frames.size()) - 1;
  const BodyPlacement first = Place(body.rest_joints, start.frames.front());
  const double ankle = std::min(body.rest_joints(1, kAnkle), body.rest_joints(1, kAnkle + 1));
  const double raise =
      ankle - body.sole_y - std::min(first.joints(2, kAnkle), first.joints(2, kAnkle + 1));
  std::vector<BodyFrame> frames;
  for (int t = 0; t < count; ++t) {
    const double place = last == 0 ? 0.0 : 0.5 * last * (1.0 - std::cos(kPi * t / last));
    const int before = std::min(static_cast<int>(place), std::max(0, last - 1));
    BodyFrame frame = Interpolate(
        start.frames[static_cast<std::size_t>(before)],
        start.frames[static_cast<std::size_t>(std::min(before + 1, last))], place - before);
    frame.pelvis.z() += raise;
    frames.push_back(frame);
  }
  return frames;
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kOwn = 40;             // generated standing poses per set
constexpr std::size_t kEnough = 10;  // minimum starts of a held-out subject
constexpr std::size_t kHeldPeople = 2;

// Subjects by name of the imported clip.
std::map<std::string, std::string> SubjectsOf(const fs::path& folder) {
  std::map<std::string, std::string> subjects;
  for (const fs::path& place : {folder, folder.parent_path()}) {
    const json manifest = ReadJson(place / "manifest.json");
    if (!manifest.is_object() || !manifest.contains("captures")) continue;
    UseJson(place / "manifest.json", [&] {
      for (const json& capture : manifest["captures"]) {
        if (!capture.is_object()) continue;
        subjects[CaptureName(capture.value("file", ""))] = capture.value("subject", "");
      }
    });
    break;
  }
  return subjects;
}

struct FoundStart {
  StandingStart start;
  bool in_held_out_folder = false;
};

// All clips (.npz) in and below a folder. A clip.npz next to samples is the best of them and is
// skipped.
std::vector<fs::path> ClipsBelow(const std::string& folder) {
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& file = entry.path();
    if (file.extension() != ".npz" || !entry.is_regular_file()) continue;
    if (file.filename() == "clip.npz" && fs::is_directory(file.parent_path() / "samples")) continue;
    files.push_back(file.string());
  }
  if (files.empty()) {
    throw Error(folder, "has no clip (.npz) in it", "Give the folder that the clips are in");
  }
  std::ranges::sort(files);
  return {files.begin(), files.end()};
}

std::vector<FoundStart> FindAll(const std::string& folder, const BodyModel& body, int threads) {
  const fs::path root = fs::path(folder).lexically_normal();
  if (!fs::is_directory(root)) {
    throw Error(folder, "is not a folder", "Give a folder of imported clips (.npz), 30 fps");
  }
  const std::vector<fs::path> files = ClipsBelow(folder);
  const std::map<std::string, std::string> subjects =
      SubjectsOf(root.has_filename() ? root : root.parent_path());
  const Eigen::Matrix3Xd rest = MeasureBody(body, {}).rest_joints;
  std::vector<std::vector<FoundStart>> found(files.size());
  ParallelFor(static_cast<int>(files.size()), threads, [&](int i) {
    const fs::path& path = files[static_cast<std::size_t>(i)];
    Clip clip = ReadClip(path);
    if (clip.frame_rate != 30.0) clip = Resample(clip, 30.0);
    const auto subject = subjects.find(path.stem().string());
    for (StandingStart& start : FindStandingStarts(rest, BodyFrames(clip, rest))) {
      start.source = path.stem().string();
      start.person = subject != subjects.end() && !subject->second.empty()
                         ? subject->second
                         : path.parent_path().filename().string();
      found[static_cast<std::size_t>(i)].push_back(
          {std::move(start), path.parent_path().filename() == "held_out"});
    }
  });
  std::vector<FoundStart> all;
  for (std::vector<FoundStart>& some : found) {
    for (FoundStart& one : some) all.push_back(std::move(one));
  }
  if (all.empty()) {
    throw Error(
        folder,
        fmt::format("has no segment where a person stands still (searched {} clips)", files.size()),
        "Give motions in which people stand still for at least a second, or leave out --starts");
  }
  return all;
}

// Held-out subjects: requested ones, else those in the held_out folder and with few starts.
std::set<std::string> HeldPeople(const std::vector<FoundStart>& all,
                                 const std::vector<std::string>& asked) {
  std::map<std::string, std::size_t> counts;
  std::set<std::string> held;
  for (const FoundStart& found : all) {
    ++counts[found.start.person];
    if (found.in_held_out_folder) held.insert(found.start.person);
  }
  if (!asked.empty()) {
    for (const std::string& name : asked) {
      if (counts.contains(name)) continue;
      std::vector<std::string> names;
      for (const auto& [person, count] : counts) names.push_back(person);
      throw Error(name, "has no segment where the person stands still",
                  fmt::format("Choose among {}", fmt::join(names, ", ")));
    }
    return {asked.begin(), asked.end()};
  }
  if (counts.size() < 3) return {};
  std::vector<std::pair<std::size_t, std::string>> few;
  for (const auto& [person, count] : counts) {
    if (count >= kEnough && !held.contains(person)) few.emplace_back(count, person);
  }
  std::ranges::sort(few);
  for (std::size_t k = 0; k < std::min(kHeldPeople, few.size()); ++k) held.insert(few[k].second);
  return held;
}

ActionStarts OwnStarts(const BodyModel& body, std::uint64_t seed,
                       const std::vector<std::string>& held_out) {
  const BodyMeasures measures = MeasureBody(body, {});
  ActionStarts starts{"own", held_out};
  for (int k = 0; k < 2 * kOwn; ++k) {
    StandingStart start =
        OwnStanding(measures, seed + kSplitMixStep * static_cast<std::uint64_t>(k + 1));
    start.source = fmt::format("own_{}", k);
    (k < kOwn ? starts.train : starts.held_out).push_back(std::move(start));
  }
  return starts;
}

}  // namespace

ActionStarts FindActionStarts(const std::string& folder, const std::vector<std::string>& held_out,
                              const BodyModel& body, std::uint64_t seed, int threads) {
  if (folder.empty()) return OwnStarts(body, seed, held_out);
  std::vector<FoundStart> all = FindAll(folder, body, threads);
  const std::set<std::string> held = HeldPeople(all, held_out);
  ActionStarts starts{fs::path(folder).filename().string(), held_out};
  std::set<std::string> train_people, held_people;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::string person = all[k].start.person;
    // With too few subjects to split them, the starts are split, so that no start is in both sets.
    const bool away = held.empty() ? k >= all.size() / 2 : held.contains(person);
    (away ? held_people : train_people).insert(person);
    (away ? starts.held_out : starts.train).push_back(std::move(all[k].start));
  }
  if (starts.train.empty() || starts.held_out.empty()) {
    throw Error(folder, "has too few people for a training and a held-out set",
                "Hold out fewer people, or give more motions");
  }
  starts.train_people.assign(train_people.begin(), train_people.end());
  starts.held_out_people.assign(held_people.begin(), held_people.end());
  return starts;
}

}  // namespace holdfast
