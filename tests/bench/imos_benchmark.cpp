// SPDX-License-Identifier: MIT
// What the networks of IMoS cost without the object's fit (random weights: the work is the same),
// one core unless said otherwise. `--scene FOLDER` writes of each weights, what a rollout is given
// and the motions made of it for imos_torch.py, which runs the same in PyTorch and compares both.
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "generator/imos/synthesis_network.h"
#include "geometry/io/container/npz.h"
#include "tests/support/imos_scene.h"

namespace holdfast::imos {
namespace {

constexpr int kSamples = 4;

struct Scene {
  explicit Scene(const Config& config) : weights(testing::DrawnNetwork(config, 3)) {
    given = testing::RandomGiven(config, kSamples, kNumKeyFrames, 5);
  }
  NetworkWeights weights;
  Network<float> network{weights};
  testing::Given<double> given;
};

using SceneOf = const Scene& (*)();
const Scene& Paper() {
  static const Scene scene(PaperConfig());
  return scene;
}
const Scene& Compact() {
  static const Scene scene(CompactConfig());
  return scene;
}
constexpr std::pair<const char*, SceneOf> kScenes[] = {{"paper", &Paper}, {"compact", &Compact}};

std::vector<SynthesisStart> Starts(const Scene& scene, int count) {
  std::vector<SynthesisStart> starts(static_cast<std::size_t>(count));
  for (SynthesisStart& start : starts) {
    for (int f = 0; f < kHistory; ++f) {
      start.poses.col(f) = scene.given.history[f].pose.col(0);
      start.roots.col(f) = scene.given.history[f].root.col(0);
      start.objects.col(f) = scene.given.objects[f].col(0);
    }
    start.condition = scene.given.conditions.col(0).cast<float>();
  }
  return starts;
}

// 15 key frames of N samples, from conditions to orthonormal poses; objects are given.
void KeyFrames(benchmark::State& state, SceneOf scene_of, int threads) {
  const Scene& scene = scene_of();
  const int count = static_cast<int>(state.range(0));
  const std::vector<SynthesisStart> starts = Starts(scene, count);
  const SynthesisRequest request{.starts = starts, .seed = 1};
  const ObjectOfFrame object = [&](int, int frame, const wandr::Pose<double>&) {
    return Eigen::Vector<double, kObjectSize>(scene.given.objects[frame].col(0));
  };
  for (auto _ : state) {
    benchmark::DoNotOptimize(RunSynthesis(scene.network, request, object, threads));
  }
  state.SetItemsProcessed(state.iterations() * count);
}

// From tensors to networks ready to run.
void Prepare(benchmark::State& state, SceneOf scene_of) {
  const Scene& scene = scene_of();
  for (auto _ : state) benchmark::DoNotOptimize(Network<float>(scene.weights).ConditionSize());
}

void Register() {
  for (const auto& [name, scene] : kScenes) {
    const auto add = [&, of = scene](const std::string& what, auto&& run) {
      return benchmark::RegisterBenchmark((what + "/" + name).c_str(), run, of)
          ->Unit(benchmark::kMillisecond);
    };
    add("KeyFrames", [](benchmark::State& s, SceneOf of) { KeyFrames(s, of, 1); })->Arg(1)->Arg(32);
    add("TwoThreads", [](benchmark::State& s, SceneOf of) { KeyFrames(s, of, 2); })
        ->Arg(64)
        ->UseRealTime();
    add("Prepare", Prepare);
  }
}

void WriteScene(const Scene& scene, const std::string& name, const std::filesystem::path& folder) {
  Rollout<float> rollout(scene.network, kSamples, kNumKeyFrames);
  testing::Roll(rollout, scene.given.Cast<float>(), scene.network.Options().NoiseSize());
  // One block per sample, frames below each other: (samples, frames, numbers) for numpy.
  NpzWriter out;
  const auto add = [&](const char* what, std::size_t frames, std::size_t rows, auto&& block_of) {
    std::vector<float> values;
    for (int i = 0; i < kSamples; ++i) {
      for (std::size_t f = 0; f < frames; ++f) {
        const Eigen::VectorXf column = block_of(static_cast<int>(f), i);
        values.insert(values.end(), column.begin(), column.end());
      }
    }
    std::vector<std::size_t> shape{kSamples, rows};
    if (frames > 1) shape.insert(shape.begin() + 1, frames);
    out.AddFloat32(what, shape, values);
  };
  const testing::Given<double>& given = scene.given;
  const int noise_size = scene.network.Options().NoiseSize();
  add("conditions", 1, static_cast<std::size_t>(given.conditions.rows()),
      [&](int, int i) { return given.conditions.col(i).cast<float>(); });
  add("poses", kHistory, kPoseSize,
      [&](int f, int i) { return given.history[f].pose.col(i).cast<float>(); });
  add("roots", kHistory, 3,
      [&](int f, int i) { return given.history[f].root.col(i).cast<float>(); });
  add("objects", kNumKeyFrames, kObjectSize,
      [&](int f, int i) { return given.objects[f].col(i).cast<float>(); });
  add("noise", kNumKeyFrames - kHistory, static_cast<std::size_t>(noise_size), [&](int f, int i) {
    return given.noise.col(i).segment(Eigen::Index{noise_size} * f, noise_size).cast<float>();
  });
  add("motions", kNumKeyFrames, kPoseSize,
      [&](int f, int i) { return rollout.Frame(f).pose.col(i); });
  add("root_tracks", kNumKeyFrames, 3, [&](int f, int i) { return rollout.Frame(f).root.col(i); });
  out.Write(folder / (name + ".npz"));
  WriteNetwork(scene.weights, folder / (name + ".safetensors"));
}

}  // namespace
}  // namespace holdfast::imos

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc == 3 && std::string_view(argv[1]) == "--scene") {
    for (const auto& [name, scene] : holdfast::imos::kScenes) {
      holdfast::imos::WriteScene(scene(), name, argv[2]);
    }
    return 0;
  }
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  holdfast::imos::Register();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
