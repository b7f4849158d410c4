// SPDX-License-Identifier: MIT
// Our side of compare.py: writes the benchmark's scene for the scripts, fits it by our own ways and
// prints, as JSON, each way's time per frame and the energies it ends with.
//   holdfast_fit_methods FRAMES SCENE.npz
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/recipes/imos_code.h"
#include "tests/bench/bench_scene.h"

using namespace holdfast;
using namespace holdfast::bench;

namespace {

// Frames 0 .. `frames`: frame 0 is given, the others are fitted.
void WriteScene(const Scene& scene, int frames, const std::filesystem::path& path) {
  const BodySurface& surface = scene.hand.Surface();
  const auto n = static_cast<std::size_t>(surface.NumVertices());
  const auto count = static_cast<std::size_t>(frames) + 1;
  const int first = HandBegin(Side::kRight);
  const auto is_finger = [&](int joint) { return joint >= first && joint < first + 15; };
  // Row-major (n, 3) and (55, 3, 3), as NumPy has them.
  std::vector<double> base, rotations, joints, offsets, wrists;
  const auto append = [](std::vector<double>& out, const auto& matrix) {
    out.insert(out.end(), matrix.data(), matrix.data() + matrix.size());
  };
  const auto append_rotation = [&](std::vector<double>& out, const Eigen::Matrix3d& R) {
    append(out, Eigen::Matrix3d(R.transpose()));
  };
  BodyState state;
  HandState hand(scene.hand);
  std::vector<double> vertices;
  for (std::size_t t = 0; t < count; ++t) {
    ForwardJoints(surface.RestJoints(), scene.clip.pose[t], scene.clip.trans.col(t), state);
    Eigen::Matrix3Xd rest = surface.RestVertices();
    for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
      if (is_finger(block.joint)) continue;
      const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> difference =
          state.local_rotation[block.joint] - Eigen::Matrix3d::Identity();
      const Eigen::Map<const Eigen::Matrix<double, 9, 1>> feature(difference.data());
      for (std::size_t k = 0; k < block.vertices.size(); ++k) {
        rest.col(block.vertices[k]) +=
            block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * feature;
      }
    }
    append(base, rest);
    for (int j = 0; j < kNumJoints; ++j) append_rotation(rotations, state.world_rotation[j]);
    append(joints, state.joints);
    append(offsets, state.skin_offset);
    hand.SetBody(scene.clip.pose[t], scene.clip.trans.col(t));
    hand.Evaluate(FingersOf(scene.clip.pose[t], Side::kRight), false);
    append(vertices, hand.Vertices());
  }
  std::vector<double> weights(n * kNumJoints, 0.0), dirs(3 * n * 9 * kJointsPerHand, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (const auto& [joint, w] : surface.Weights(static_cast<int>(i))) {
      weights[i * kNumJoints + static_cast<std::size_t>(joint)] = w;
    }
  }
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    if (!is_finger(block.joint)) continue;
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t row = 3 * static_cast<std::size_t>(block.vertices[k]) + c;
        for (std::size_t f = 0; f < 9; ++f) {
          dirs[row * 9 * kJointsPerHand + 9 * static_cast<std::size_t>(block.joint - first) + f] =
              block.dirs(static_cast<Eigen::Index>(3 * k + c), static_cast<Eigen::Index>(f));
        }
      }
    }
  }
  std::vector<double> fingers, rest_joints, object, orientation;
  append(fingers, FingersOf(scene.clip.pose[0], Side::kRight));
  append(rest_joints, surface.RestJoints());
  append(object, scene.object);
  append_rotation(orientation, scene.first.orientation.toRotationMatrix());
  const Eigen::Vector3d T = scene.first.translation;
  const FitOptions options = Options(PairPrecision::kDouble);

  NpzWriter writer;
  writer.AddFloat64("base", {count, n, 3}, base);  // blend shapes of all joints but the fingers
  writer.AddFloat64("world_rotation", {count, kNumJoints, 3, 3}, rotations);
  writer.AddFloat64("joints", {count, kNumJoints, 3}, joints);
  writer.AddFloat64("skin_offset", {count, kNumJoints, 3}, offsets);
  writer.AddFloat64("clip_vertices", {count, n, 3}, vertices);  // with the clip's own fingers
  writer.AddFloat64("weights", {n, kNumJoints}, weights);
  writer.AddFloat64("finger_dirs", {3 * n, 9 * kJointsPerHand}, dirs);
  writer.AddFloat64("rest_joints", {kNumJoints, 3}, rest_joints);
  writer.AddInt64("first_finger_joint", {}, {first});
  writer.AddInt64("wrist", {}, {WristJoint(Side::kRight)});
  writer.AddFloat64("fingers", {kHandDofs}, fingers);
  writer.AddFloat64("object", {static_cast<std::size_t>(scene.object.cols()), 3}, object);
  writer.AddFloat64("orientation", {3, 3}, orientation);
  writer.AddFloat64("translation", {3}, {T.x(), T.y(), T.z()});
  writer.AddFloat64("lambdas", {3},
                    {options.lambda_distance, options.lambda_contact, options.lambda_temporal});
  writer.AddFloat64("tau", {}, {options.contact_threshold_m});
  writer.Write(path);
}

// Calls `solve` for frames 1 .. `frames`, in `repeats` passes; of each frame's times the median.
nlohmann::json Measure(int frames, int repeats,
                       const std::function<std::function<double(int)>()>& begin) {
  std::vector<std::vector<double>> times(static_cast<std::size_t>(frames));
  std::vector<double> ms, energies(times.size());
  for (int k = 0; k < repeats; ++k) {
    const std::function<double(int)> solve = begin();
    for (int t = 1; t <= frames; ++t) {
      const auto frame = static_cast<std::size_t>(t - 1);
      const auto start = std::chrono::steady_clock::now();
      energies[frame] = solve(t);
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      times[frame].push_back(took.count());
    }
  }
  for (std::vector<double>& of_frame : times) {
    std::ranges::nth_element(of_frame, of_frame.begin() + repeats / 2);
    ms.push_back(of_frame[static_cast<std::size_t>(repeats) / 2]);
  }
  return {{"ms", ms}, {"energies", energies}, {"repeats", repeats}};
}

nlohmann::json Ours(const Scene& scene, int frames, PairPrecision precision) {
  std::unique_ptr<FrameFitter> fitter;
  return Measure(frames, 20, [&] {
    fitter = scene.Fitter(Options(precision));
    return [&](int t) {
      return fitter->Solve(scene.clip.pose[t], scene.clip.trans.col(t)).energy_total;
    };
  });
}

nlohmann::json Recipe(const Scene& scene, int frames) {
  Clip clip = Slice(scene.clip, 0, frames + 1);
  clip.object.emplace();
  clip.object->trans.setZero(3, frames + 1);
  clip.object->orient.setZero(3, frames + 1);
  clip.object->trans.col(0) = scene.first.translation;
  clip.object->orient.col(0) = LogSO3(scene.first.orientation.toRotationMatrix());
  const FitResult result = FitClipImosCode(clip, scene.hand, scene.object);
  const FitOptions options = Options(PairPrecision::kDouble);
  std::vector<double> ms, energies;
  for (int t = 1; t <= frames; ++t) {
    const FrameReport& frame = result.frames[static_cast<std::size_t>(t)];
    ms.push_back(frame.solve_ms);
    energies.push_back(options.lambda_distance * frame.energies[EnergyTerm::kDistance] +
                       options.lambda_contact * frame.energies[EnergyTerm::kContact] +
                       options.lambda_temporal * frame.energies[EnergyTerm::kTemporal]);
  }
  return {{"ms", ms}, {"energies", energies}, {"repeats", 1}};
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc == 3 ? std::atoi(argv[1]) : 0;
  if (frames < 1 || frames >= kFrames) {
    fmt::print(stderr, "usage: holdfast_fit_methods FRAMES SCENE.npz    (1 to {} frames)\n",
               kFrames - 1);
    return 2;
  }
  try {
    const Scene& scene = TheScene();
    WriteScene(scene, frames, argv[2]);
    nlohmann::json report = {{"hand_vertices", scene.hand.NumVertices()},
                             {"object_vertices", scene.object.cols()}};
    report["single"] = Ours(scene, frames, PairPrecision::kSingle);
    report["double"] = Ours(scene, frames, PairPrecision::kDouble);
    report["imos_code"] = Recipe(scene, frames);
    std::unique_ptr<PlainFitter> plain;
    report["plain"] = Measure(frames, 1, [&] {
      plain = std::make_unique<PlainFitter>(scene, Options(PairPrecision::kDouble));
      return [&](int t) { return plain->Solve(t); };
    });
    fmt::print("{}\n", report.dump(1));
  } catch (const Error& error) {
    fmt::print(stderr, "holdfast_fit_methods: {}\n", error.what());
    return 1;
  }
  return 0;
}
