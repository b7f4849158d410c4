// SPDX-License-Identifier: MIT
// What a WANDR rollout costs: the published network and residual ones (random weights: the work is
// the same), one core unless said otherwise. `--scene FOLDER` writes of each weights, starts,
// latents and the motions made of them for wandr_torch.py, which runs the same in PyTorch and
// compares both.
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "generator/wandr/motion_states.h"
#include "geometry/io/container/npz.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

constexpr int kSteps = 240;
constexpr int kMaxBodies = 3750;  // of the paper's evaluation

// Random weights make a chaotic loop; a damped last layer makes it comparable over 8 s.
NetworkWeights Damped(const NetworkWeights& weights) {
  return testing::WithScaledOutput(weights, 0.05f);
}

NetworkWeights Residual(int width, int blocks) {
  return Damped(RandomResidualNetwork(IntentionLayout::kPaper, 1, testing::WalkingStatistics(),
                                      kLatentSize, width, blocks));
}

struct Scene {
  explicit Scene(const NetworkWeights& from) : weights(from), network(weights) {
    nn::RandomStream random(5);
    for (int i = 0; i < kMaxBodies; ++i) {
      starts.push_back(testing::RandomStart(random).Cast<float>());
      plans.push_back({{Eigen::Vector3d(i % 5 - 2.0, i % 3 - 1.0, 0.45 * (i % 4)), kSteps}});
    }
  }
  RolloutRequest Request(int count) const {
    return {.starts = std::span(starts).first(count),
            .plans = std::span(plans).first(count),
            .num_steps = kSteps,
            .seed = 3};
  }

  NetworkWeights weights;
  Network<float> network;
  BoneOffsets<float> bones = testing::DefaultBones().Cast<float>();
  std::vector<RolloutStart<float>> starts;
  std::vector<GoalPlan> plans;
};

// The networks measured, by the name that the benchmarks and the files of --scene bear.
using SceneOf = const Scene& (*)();
const Scene& Published() {
  static const Scene scene(
      Damped(RandomNetwork(IntentionLayout::kPaper, 1, testing::WalkingStatistics())));
  return scene;
}
const Scene& Residual256x4() {
  static const Scene scene(Residual(256, 4));
  return scene;
}
const Scene& Residual512x4() {
  static const Scene scene(Residual(512, 4));
  return scene;
}
constexpr std::pair<const char*, SceneOf> kScenes[] = {{"published", &Published},
                                                       {"residual256x4", &Residual256x4},
                                                       {"residual512x4", &Residual512x4}};

// One closed-loop step of N bodies: features, decoder, integration.
void Step(benchmark::State& state, SceneOf scene_of) {
  const Scene& scene = scene_of();
  const int count = static_cast<int>(state.range(0));
  Rollout<float> rollout(scene.network, scene.bones, count, kSteps);
  const Eigen::MatrixXf latents = Eigen::MatrixXf::Random(kLatentSize, count);
  const RolloutRequest request = scene.Request(count);
  rollout.Begin(request.starts, request.plans);
  for (auto _ : state) {
    if (rollout.NumSteps() == kSteps) rollout.Begin(request.starts, request.plans);
    rollout.Step(latents);
  }
  state.SetItemsProcessed(state.iterations() * count);
}

void DecoderAlone(benchmark::State& state, SceneOf scene_of) {
  const Scene& scene = scene_of();
  const int count = static_cast<int>(state.range(0));
  nn::Tape<float> tape(scene.network.Decoder(), count);
  tape.Input().setRandom();
  for (auto _ : state) scene.network.Decoder().Forward(tape);
  state.SetItemsProcessed(state.iterations() * count);
}

// 8 s of N motions, latents drawn and joints computed.
void EightSeconds(benchmark::State& state, SceneOf scene_of) {
  const Scene& scene = scene_of();
  const int count = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(1));
  const RolloutRequest request = scene.Request(count);
  for (auto _ : state) {
    RunRollouts(
        scene.network, scene.bones, request, threads, {},
        [](int, const RolloutTrack& track) { benchmark::DoNotOptimize(track.joints.data()); });
  }
  state.SetItemsProcessed(state.iterations() * count);
}

// The wrist at the end with respect to everything: one row, or the three of its position.
void Gradient(benchmark::State& state, SceneOf scene_of) {
  const Scene& scene = scene_of();
  const int rows = static_cast<int>(state.range(0));
  Rollout<float> rollout(scene.network, scene.bones, 1, kSteps, {}, true);
  const RolloutRequest request = scene.Request(1);
  const Eigen::MatrixXf latents = Eigen::MatrixXf::Random(kLatentSize, kSteps);
  RolloutSeed<float> seed;
  seed.joints.resize(kSteps + 1);
  seed.joints[kSteps].setZero(kJointNumbers, rows);
  for (int r = 0; r < rows; ++r) seed.joints[kSteps](3 * 21 + r, r) = 1.0f;
  RolloutGradient<float> gradient;
  for (auto _ : state) {
    rollout.Begin(request.starts, request.plans);
    for (int t = 0; t < kSteps; ++t) rollout.Step(latents.col(t));
    rollout.Backward(seed, rows, gradient);
    benchmark::DoNotOptimize(gradient.latents.data());
  }
}

void Register() {
  for (const auto& [name, scene] : kScenes) {
    const auto add = [&, of = scene](const std::string& what, auto* run) {
      return benchmark::RegisterBenchmark((what + "/" + name).c_str(), run, of);
    };
    add("DecoderAlone", DecoderAlone)->Arg(1)->Arg(64)->Unit(benchmark::kMicrosecond);
    add("Step", Step)->Arg(1)->Arg(64)->Arg(750)->Unit(benchmark::kMicrosecond);
    add("EightSeconds", EightSeconds)
        ->Args({1, 1})
        ->Args({64, 1})
        ->Args({750, 1})
        ->Args({750, 2})
        ->Args({kMaxBodies, 2})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->MeasureProcessCPUTime();
    add("Gradient", Gradient)->Arg(1)->Arg(3)->Unit(benchmark::kMillisecond);
  }
}

void WriteScene(const Scene& scene, const std::string& name, const std::filesystem::path& folder) {
  constexpr std::size_t kCount = 4;
  const RolloutRequest request = scene.Request(kCount);
  const auto tracks = RunRollouts(scene.network, scene.bones, request, 1);
  const auto floats = [](const auto& m) {
    return std::vector<float>(m.data(), m.data() + m.size());
  };
  NpzWriter out;
  std::vector<float> states, previous, goals, latents, motions;
  const auto append = [](std::vector<float>& to, const std::vector<float>& values) {
    to.insert(to.end(), values.begin(), values.end());
  };
  for (std::size_t i = 0; i < kCount; ++i) {
    append(states, floats(StateOf(scene.starts[i].pose)));
    append(previous, floats(scene.starts[i].previous_delta));
    append(goals, floats(Eigen::Vector3f(scene.plans[i][0].position.cast<float>())));
    append(latents, floats(DrawLatents(request.seed, i, kLatentSize, kSteps, 1.0)));
    append(motions, floats(tracks[i].states));
  }
  const Eigen::MatrixXf rest = testing::DefaultBody().rest_joints.leftCols<22>().cast<float>();
  out.AddFloat32("rest_joints", {22, 3}, floats(rest));
  out.AddFloat32("states", {kCount, kStateSize}, states);
  out.AddFloat32("previous_deltas", {kCount, kStateSize}, previous);
  out.AddFloat32("goals", {kCount, 3}, goals);
  out.AddFloat32("latents", {kCount, kSteps, kLatentSize}, latents);
  out.AddFloat32("motions", {kCount, kSteps + 1, kStateSize}, motions);
  out.Write(folder / (name + ".npz"));
  WriteNetwork(scene.weights, folder / (name + ".safetensors"));
}

}  // namespace
}  // namespace holdfast::wandr

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc == 3 && std::string_view(argv[1]) == "--scene") {
    for (const auto& [name, scene] : holdfast::wandr::kScenes) {
      holdfast::wandr::WriteScene(scene(), name, argv[2]);
    }
    return 0;
  }
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  holdfast::wandr::Register();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
