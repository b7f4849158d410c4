// SPDX-License-Identifier: MIT
#include "solver/evaluation/captured_reaches.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/evaluation/reach_method_study.h"

namespace holdfast {

namespace fs = std::filesystem;

CapturedClips ReadCapturedClips(const std::vector<std::string>& paths) {
  std::vector<fs::path> files;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      files.emplace_back(path);
      continue;
    }
    const std::size_t before = files.size();
    for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
      if (entry.path().extension() == ".npz") files.push_back(entry.path());
    }
    std::sort(files.begin() + static_cast<std::ptrdiff_t>(before), files.end());
    if (files.size() == before) {
      throw Error(path, "has no clip (.npz) in it", "Give the folder that the clips are in");
    }
  }
  CapturedClips captured;
  for (const fs::path& file : files) {
    captured.names.push_back(file.stem().string());
    captured.clips.push_back(ReadClip(file));
  }
  return captured;
}

std::vector<wandr::ReachStart> StartsFrom(const CapturedClips& captured,
                                          const wandr::Normalizer<double>& normalizer) {
  std::vector<wandr::StartCandidate> candidates;
  for (std::size_t i = 0; i < captured.clips.size(); ++i) {
    const Clip& clip = captured.clips[i];
    candidates.push_back(
        {captured.names[i], clip.subject, static_cast<int>(wandr::StatesOfClip(clip).cols())});
  }
  std::vector<Clip> clips;
  std::vector<std::string> names;
  for (const int i : wandr::ChooseStartClips(candidates)) {
    clips.push_back(captured.clips[i]);
    names.push_back(fmt::format("{}, frame {}", captured.names[i], wandr::kReachStartFrame));
  }
  return wandr::StartsOfClips(clips, names, normalizer);
}

std::vector<CapturedMotion> MeasureCaptured(const CapturedClips& captured,
                                            const wandr::LowestPoint& lowest,
                                            const wandr::BoneOffsets<float>& bones, int threads) {
  constexpr double kWalks = 1.0;  // meters that the pelvis gets away
  std::vector<CapturedMotion> measured(captured.clips.size());
  ParallelFor(static_cast<int>(measured.size()), threads, [&](int i) {
    const wandr::StateMatrix<float> states = wandr::StatesOfClip(captured.clips[i]).cast<float>();
    Eigen::MatrixXf joints(wandr::kJointNumbers, states.cols());
    wandr::BodyKinematics<float> kinematics;
    for (Eigen::Index f = 0; f < states.cols(); ++f) {
      wandr::ForwardKinematics(bones, wandr::PoseOf<float>(states.col(f)), kinematics);
      Eigen::Map<wandr::BodyJoints<float>>(joints.col(f).data()) = kinematics.joints;
      const double away = (joints.block<2, 1>(0, f) - joints.block<2, 1>(0, 0)).norm();
      measured[i].walks = measured[i].walks || away >= kWalks;
    }
    measured[i].motion.outcome = wandr::MeasureReach(joints, Eigen::Vector3d::Zero());
    measured[i].motion.surface_skating = wandr::SkatingOfLowestVertex(lowest, states);
    measured[i].fast_share = FastShare(joints);
  });
  return measured;
}

CapturedSkating SkatingOf(const std::vector<CapturedMotion>& motions) {
  CapturedSkating skating;
  for (const CapturedMotion& one : motions) {
    ++skating.clips;
    skating.surface += one.motion.surface_skating;
    skating.joints += one.motion.outcome.skating_share;
    if (!one.walks) continue;
    ++skating.walking_clips;
    skating.walking_surface += one.motion.surface_skating;
    skating.walking_joints += one.motion.outcome.skating_share;
  }
  const double all = std::max(skating.clips, 1), walking = std::max(skating.walking_clips, 1);
  skating.surface /= all;
  skating.joints /= all;
  skating.walking_surface /= walking;
  skating.walking_joints /= walking;
  return skating;
}

}  // namespace holdfast
