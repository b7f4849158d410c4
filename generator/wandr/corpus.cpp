// SPDX-License-Identifier: MIT
#include "generator/wandr/corpus.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "geometry/clip/clip.h"
#include "geometry/error.h"
#include "geometry/io/container/npz.h"

namespace holdfast::wandr {
namespace {

namespace fs = std::filesystem;

constexpr int kShortestClip = 24;  // frames

std::vector<fs::path> ClipsIn(const fs::path& folder) {
  return ClipsBelow(folder, {"held_out", "dropped"},
                    "Give a folder that 'holdfast make-reach-data' wrote, or one of clips (.npz)");
}

GoalPlan GoalsOf(const NpzReader& archive, const std::string& where, int num_frames, Side wrist) {
  GoalPlan goals;
  if (!archive.Has("goal") || !archive.Has("goal_frame")) return goals;
  const std::vector<double> positions = archive.Read("goal").AsDoubles();
  const std::vector<double> frames = archive.Read("goal_frame").AsDoubles();
  std::vector<double> wrists;
  if (archive.Has("goal_wrist")) wrists = archive.Read("goal_wrist").AsDoubles();
  if (positions.size() != 3 * frames.size() ||
      (!wrists.empty() && wrists.size() != frames.size())) {
    throw Error(where,
                fmt::format("goal has {} numbers, goal_frame {}, goal_wrist {}", positions.size(),
                            frames.size(), wrists.size()),
                "Give three coordinates, one frame and one wrist per goal");
  }
  const double code = wrist == Side::kRight ? 1.0 : 2.0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (!wrists.empty() && wrists[k] != code) continue;
    const Eigen::Vector3d position(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]);
    if (!(frames[k] >= 0.0 && frames[k] < num_frames) || !position.allFinite()) {
      throw Error(where + "[goal]", fmt::format("goal {} is not within the clip", k),
                  "Count frames from 0, and give finite positions");
    }
    goals.push_back({position, static_cast<int>(frames[k])});
  }
  std::sort(goals.begin(), goals.end(),
            [](const Waypoint& a, const Waypoint& b) { return a.frame < b.frame; });
  return goals;
}

std::optional<CorpusClip> ReadOne(const fs::path& path, Side wrist,
                                  std::vector<std::string>* notes) {
  const NpzReader archive(path);
  const Clip clip = ReadClip(archive);
  const StateMatrix<double> states = StatesOfClip(clip);
  if (states.cols() < kShortestClip) {
    if (notes) notes->push_back(fmt::format("{}: {} frames", path.string(), states.cols()));
    return std::nullopt;
  }
  CorpusClip out;
  out.name = path.stem().string();
  for (Eigen::Index t = 0; t < states.cols(); ++t) {
    out.poses.push_back(PoseOf<double>(states.col(t)).Cast<float>());
  }
  out.made = archive.Has("goal");
  out.goals = GoalsOf(archive, path.string(), static_cast<int>(states.cols()), wrist);
  return out;
}

CorpusClip MirroredClip(const CorpusClip& clip, const Eigen::Vector3d& rest_pelvis) {
  CorpusClip out;
  out.name = clip.name + " mirrored";
  for (const Pose<float>& pose : clip.poses) {
    out.poses.push_back(Mirrored(pose.Cast<double>(), rest_pelvis).Cast<float>());
  }
  return out;
}

}  // namespace

std::vector<fs::path> ClipsBelow(const fs::path& folder,
                                 std::initializer_list<std::string_view> skipped,
                                 const char* remedy) {
  if (!fs::is_directory(folder)) throw Error(folder.string(), "is not a folder of clips", remedy);
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(folder); it != fs::end(it); ++it) {
    const fs::path& path = it->path();
    if (it->is_directory() && std::ranges::count(skipped, path.filename().string()) > 0) {
      it.disable_recursion_pending();
    } else if (it->is_regular_file() && path.extension() == ".npz") {
      files.push_back(path);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<CorpusClip> ReadCorpusClips(const fs::path& folder, Side wrist,
                                        std::vector<std::string>* notes) {
  std::vector<CorpusClip> clips;
  for (const fs::path& path : ClipsIn(folder)) {
    if (auto clip = ReadOne(path, wrist, notes)) clips.push_back(std::move(*clip));
  }
  return clips;
}

Corpus ReadCorpus(const std::vector<fs::path>& folders, const Eigen::Matrix3Xd& rest_joints,
                  double made_hours, bool mirror, Side wrist,
                  const std::function<void(int, int)>& progress) {
  std::vector<fs::path> files;
  for (const fs::path& folder : folders) {
    const std::vector<fs::path> found = ClipsIn(folder);
    files.insert(files.end(), found.begin(), found.end());
  }
  Corpus corpus;
  StatisticsGatherer gatherer;
  const long most_made = std::lround(std::min(made_hours, 1e6) * 3600.0 * kFramesPerSecond);
  const auto add = [&](CorpusClip clip) {
    (clip.made ? corpus.made_frames : corpus.captured_frames) +=
        static_cast<long>(clip.poses.size());
    StateMatrix<double> states(kStateSize, static_cast<Eigen::Index>(clip.poses.size()));
    for (Eigen::Index t = 0; t < states.cols(); ++t) {
      WriteState<double>(clip.poses[t].Cast<double>(), states.col(t));
    }
    gatherer.Add(states);
    corpus.clips.push_back(std::move(clip));
  };
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (progress) progress(static_cast<int>(k), static_cast<int>(files.size()));
    std::optional<CorpusClip> clip = ReadOne(files[k], wrist, &corpus.notes);
    if (!clip) continue;
    if (clip->made && corpus.made_frames >= most_made) continue;
    if (mirror && !clip->made) add(MirroredClip(*clip, rest_joints.col(0)));
    add(std::move(*clip));
  }
  if (progress) progress(static_cast<int>(files.size()), static_cast<int>(files.size()));
  if (corpus.clips.empty()) {
    throw Error(folders.empty() ? "corpus" : folders.front().string(),
                fmt::format("none of {} file(s) has the {} frames that training needs",
                            files.size(), kShortestClip),
                "Make a corpus with 'holdfast make-reach-data', or import clips");
  }
  corpus.statistics = gatherer.Finish();
  return corpus;
}

}  // namespace holdfast::wandr
