// SPDX-License-Identifier: MIT
#include "generator/actions/action_starts.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/matching/capture_set.h"
#include "generator/walk_statistics/motion_set.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/read_json.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kOwn = 40;             // standing poses of Holdfast's own, per side
constexpr std::size_t kEnough = 10;  // starts of a person who may be held out
constexpr std::size_t kHeldPeople = 2;

// Subjects by the imported clip's name.
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

std::vector<FoundStart> FindAll(const std::string& folder, const BodyModel& body, int threads) {
  const fs::path root = fs::path(folder).lexically_normal();
  if (!fs::is_directory(root)) {
    throw Error(folder, "is not a folder", "Give a folder of imported clips (.npz), 30 fps");
  }
  const std::vector<MotionFile> files = MotionFilesOf(folder);
  const std::map<std::string, std::string> subjects =
      SubjectsOf(root.has_filename() ? root : root.parent_path());
  const Eigen::Matrix3Xd rest = MeasureBody(body, {}).rest_joints;
  std::vector<std::vector<FoundStart>> found(files.size());
  ParallelFor(static_cast<int>(files.size()), threads, [&](int i) {
    const fs::path path = files[static_cast<std::size_t>(i)].path;
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
        fmt::format("has no segment where the person stands still, in {} clips", files.size()),
        "Give motions in which people stand for a second at least, or leave out --starts");
  }
  return all;
}

// Who is held out: asked for, in the held_out folder, or who has the fewest starts.
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
                  fmt::format("There are {}", fmt::join(names, ", ")));
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
    // With too few people to part them, at least nobody's moment is in both.
    const bool away = held.empty() ? k >= all.size() / 2 : held.contains(person);
    (away ? held_people : train_people).insert(person);
    (away ? starts.held_out : starts.train).push_back(std::move(all[k].start));
  }
  if (starts.train.empty() || starts.held_out.empty()) {
    throw Error(folder, "leaves nobody to learn from, or nobody to hold out",
                "Hold out fewer people, or give more motions");
  }
  starts.train_people.assign(train_people.begin(), train_people.end());
  starts.held_out_people.assign(held_people.begin(), held_people.end());
  return starts;
}

}  // namespace holdfast
