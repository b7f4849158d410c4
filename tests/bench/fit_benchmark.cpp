// SPDX-License-Identifier: MIT
// The object fit against the same problem given to Ceres residual by residual, and what its parts
// cost. Prints the ratios, and the energies both ways end with, after the table.
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "tests/bench/bench_scene.h"

namespace holdfast {
namespace {

using namespace bench;

std::map<std::string, std::vector<double>> energies;  // by way, frames 1, 2, ...

void Compressed(benchmark::State& state, PairPrecision precision, const char* name) {
  const Scene& scene = TheScene();
  std::vector<double> reached;
  double iterations = 0.0, frames = 0.0;
  std::unique_ptr<FrameFitter> fitter = scene.Fitter(Options(precision));
  int frame = 0;
  for (auto _ : state) {
    if (++frame == kFrames) {
      state.PauseTiming();
      fitter = scene.Fitter(Options(precision));
      frame = 1;
      state.ResumeTiming();
    }
    const FrameReport report = fitter->Solve(scene.clip.pose[frame], scene.clip.trans.col(frame));
    if (static_cast<int>(reached.size()) < frame) reached.push_back(report.energy_total);
    iterations += report.iterations;
    frames += 1.0;
  }
  state.counters["iterations"] = iterations / frames;
  state.counters["hand_vertices"] = scene.hand.NumVertices();
  energies[name] = reached;
}

void BM_FrameHoldfast(benchmark::State& state) {
  Compressed(state, PairPrecision::kSingle, "holdfast");
}
BENCHMARK(BM_FrameHoldfast)->Unit(benchmark::kMillisecond)->MinTime(2.0)->UseRealTime();

void BM_FrameHoldfastDouble(benchmark::State& state) {
  Compressed(state, PairPrecision::kDouble, "holdfast, double");
}
BENCHMARK(BM_FrameHoldfastDouble)->Unit(benchmark::kMillisecond)->MinTime(1.0)->UseRealTime();

void BM_FramePlainCeres(benchmark::State& state) {
  const Scene& scene = TheScene();
  PlainFitter fitter(scene, Options(PairPrecision::kDouble));
  std::vector<double> reached;
  int frame = 0;
  for (auto _ : state) {
    reached.push_back(fitter.Solve(++frame));
  }
  energies["plain Ceres"] = reached;
}
BENCHMARK(BM_FramePlainCeres)->Unit(benchmark::kMillisecond)->Iterations(6)->UseRealTime();

template <typename Real>
void BM_PairKernel(benchmark::State& state) {
  const auto isa = static_cast<Isa>(state.range(0));
  if (!IsSupported(isa)) {
    state.SkipWithError("not on this processor");
    return;
  }
  std::srand(1);
  const Eigen::Matrix3Xd points = 0.1 * Eigen::Matrix3Xd::Random(3, 850);
  const PairTargets<Real> targets(TheScene().object);
  const Eigen::Matrix<Real, 3, Eigen::Dynamic> z = points.cast<Real>();
  const std::vector<Real> reference(850 * static_cast<std::size_t>(targets.Stride()), Real(0.05));
  std::vector<PairSums> sums(850);
  for (auto _ : state) {
    SumPairs<Real>(isa, targets, z.data(), 850, reference.data(), sums.data());
    benchmark::DoNotOptimize(sums.data());
  }
  state.SetLabel(std::string(IsaName(isa)));
  state.counters["pairs/s"] = benchmark::Counter(
      850.0 * 300.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_PairKernel<float>)->DenseRange(0, 3)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_PairKernel<double>)->DenseRange(0, 3)->Unit(benchmark::kMicrosecond);

void BM_HandForward(benchmark::State& state) {
  const Scene& scene = TheScene();
  HandState hand(scene.hand);
  hand.SetBody(scene.clip.pose[0], scene.clip.trans.col(0));
  const FingerPose fingers = FingersOf(scene.clip.pose[0], Side::kRight);
  for (auto _ : state) hand.Evaluate(fingers, state.range(0) != 0);
  state.SetLabel(state.range(0) != 0 ? "with Jacobian" : "vertices");
}
BENCHMARK(BM_HandForward)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

// One evaluation of E_d and E_c as Ceres asks for it: cost alone, or with the 51 + 1 rows.
void BM_Evaluate(benchmark::State& state) {
  const Scene& scene = TheScene();
  HandState hand(scene.hand);
  hand.SetBody(scene.clip.pose[0], scene.clip.trans.col(0));
  FingerPose fingers = FingersOf(scene.clip.pose[0], Side::kRight);
  hand.Evaluate(fingers, false);
  const Eigen::MatrixXd reference = HandObjectDistance::Distances(
      InObjectFrame(hand.Vertices(), scene.first.orientation, scene.first.translation),
      scene.object);
  const HandObjectDistance distance(scene.object, reference, 1.0);
  const Contact contact(scene.object, reference, 0.01, 1.0);
  HandObjectBlock block(&hand);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  block.AddTerm(EnergyTerm::kContact, &contact);
  const double* parameters[] = {scene.first.orientation.coeffs().data(),
                                scene.first.translation.data(), fingers.data()};
  Eigen::Matrix<double, HandObjectBlock::kRows, 1> r;
  Eigen::Matrix<double, HandObjectBlock::kRows, 4, Eigen::RowMajor> J_q;
  Eigen::Matrix<double, HandObjectBlock::kRows, 3, Eigen::RowMajor> J_t;
  Eigen::Matrix<double, HandObjectBlock::kRows, kHandDofs, Eigen::RowMajor> J_p;
  double* jacobians[] = {J_q.data(), J_t.data(), J_p.data()};
  HandObjectBlock::System system;
  for (auto _ : state) {
    fingers(0) += 1e-9;  // another point each time, or the block remembers
    if (state.range(0) == 1) {
      block.Linearize(parameters, system);
    } else {
      block.Evaluate(parameters, r.data(), state.range(0) == 2 ? jacobians : nullptr);
    }
  }
  const char* kLabels[] = {"cost", "51 x 51 system", "51 + 1 rows"};
  state.SetLabel(kLabels[state.range(0)]);
}
BENCHMARK(BM_Evaluate)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_BodyForward(benchmark::State& state) {
  const Scene& scene = TheScene();
  const BodySurface surface(scene.model);
  BodyState body;
  for (auto _ : state) Forward(surface, scene.clip.pose[0], scene.clip.trans.col(0), body);
  state.counters["vertices"] = surface.NumVertices();
}
BENCHMARK(BM_BodyForward)->Unit(benchmark::kMicrosecond);

// Keeps each benchmark's time for the summary.
class Reporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (!run.error_occurred) milliseconds[run.run_name.function_name] = run.GetAdjustedRealTime();
    }
    ConsoleReporter::ReportRuns(runs);
  }
  std::map<std::string, double> milliseconds;
};

void PrintSummary(const Reporter& reporter) {
  const auto at = [&](const char* name) {
    const auto it = reporter.milliseconds.find(name);
    return it == reporter.milliseconds.end() ? NAN : it->second;
  };
  const double ours = at("BM_FrameHoldfast"), plain = at("BM_FramePlainCeres");
  if (std::isnan(ours) || std::isnan(plain)) return;
  const Scene& scene = TheScene();
  fmt::print("\nOne hand ({} vertices), {} object vertices, {} pair residuals per frame\n",
             scene.hand.NumVertices(), scene.object.cols(),
             scene.hand.NumVertices() * scene.object.cols());
  fmt::print("  plain Ceres, all pairs         {:9.2f} ms per frame\n", plain);
  fmt::print("  holdfast, double pair loop     {:9.3f} ms per frame, {:6.0f} times faster\n",
             at("BM_FrameHoldfastDouble"), plain / at("BM_FrameHoldfastDouble"));
  fmt::print("  holdfast, single pair loop     {:9.3f} ms per frame, {:6.0f} times faster\n", ours,
             plain / ours);
  const std::vector<double>& truth = energies["plain Ceres"];
  for (const char* name : {"holdfast", "holdfast, double"}) {
    double worst = 0.0;
    for (std::size_t k = 0; k < truth.size() && k < energies[name].size(); ++k) {
      worst = std::max(worst, std::abs(energies[name][k] - truth[k]) / truth[k]);
    }
    fmt::print("  final energy, {} against plain: {:.1e} relative, worst of {} frames\n", name,
               worst, truth.size());
  }
}

}  // namespace
}  // namespace holdfast

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  holdfast::Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  holdfast::PrintSummary(reporter);
  return 0;
}
