// SPDX-License-Identifier: MIT
#include "solver/evaluation/synthesis/synthesis_study.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "generator/imos/face_error.h"
#include "generator/imos/synthesis_metrics_motion.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/parallel.h"
#include "solver/evaluation/study_blocks.h"
#include "solver/score/metric_values.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kSlowBlock = 16;   // cases in a file, where each takes a second
constexpr int kFastBlock = 256;  // where many are made at once
constexpr double kRate_Hz = 30.0;
// Blocks of another format count as those of another configuration.
constexpr const char* kBlockFormat = "holdfast-synthesis-block-3";
constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

void AddBytes(const Eigen::Ref<const Eigen::MatrixXd>& numbers, std::string& text) {
  const Eigen::MatrixXd dense = numbers;
  text.append(reinterpret_cast<const char*>(dense.data()), sizeof(double) * dense.size());
}

std::string ChecksumOf(std::span<const SynthesisCase> cases) {
  std::string text;
  for (const SynthesisCase& one : cases) {
    text += fmt::format("{} {} {} {}\n", one.sequence.subject, one.sequence.name,
                        one.sequence.action, one.sequence.object);
    AddBytes(one.sequence.joints, text);
    AddBytes(one.sequence.object_transl, text);
    AddBytes(one.sequence.object_rotation, text);
  }
  return Checksum(text);
}

std::vector<double> Doubles(const NpyMember& member, std::size_t expected) {
  std::vector<double> values = member.AsDoubles();
  if (values.size() != expected) throw Error("", "holds another number of values", "");
  return values;
}

// Thresholds as `score` has them, without the volumes.
ScoreOptions WithoutVolumes() {
  ScoreOptions options;
  options.hand_object.measure_voxels = false;
  options.hand_object.measure_exact = false;
  options.exact = ExactMode::kOff;
  return options;
}

}  // namespace

SynthesisStudy::SynthesisStudy(fs::path folder, std::span<const SynthesisCase> cases,
                               const imos::Recognizer& recognizer,
                               const std::string& recognizer_checksum,
                               const SynthesisStudyOptions& options, std::function<bool()> stopped)
    : folder_(std::move(folder)),
      cases_(cases),
      recognizer_(recognizer),
      asked_(fmt::format("{} {}", ChecksumOf(cases), recognizer_checksum)),
      options_(options),
      stopped_(std::move(stopped)) {
  fs::create_directories(folder_ / "blocks");
}

bool SynthesisStudy::MeasuresObject(int repeat, int index) const {
  const auto total = static_cast<std::int64_t>(cases_.size());
  const std::int64_t some = std::min<std::int64_t>(options_.object_cases, total);
  return repeat == 0 && index * some / total != (index + 1) * some / total;
}

int SynthesisStudy::BlockSize(const SynthesisRow& row, int repeat) const {
  const bool slow = repeat == 0 || row.mode == ObjectMode::kFitted;
  return slow ? kSlowBlock : kFastBlock;
}

fs::path SynthesisStudy::BlockFile(const SynthesisRow& row, int repeat, int first) const {
  const std::string mode = row.network ? ObjectModeName(row.mode) + "_" : "";
  return folder_ / "blocks" /
         fmt::format("{}{}_{:02d}_{:04d}.safetensors", mode, row.key, repeat, first);
}

std::string SynthesisStudy::Question(const SynthesisRow& row, int repeat) const {
  std::string all =
      fmt::format("{} {} {} {} of {}", kBlockFormat, asked_, row.key, repeat, cases_.size());
  if (repeat == 0) all += fmt::format(" objects of {}", options_.object_cases);
  if (row.network) {
    all += fmt::format(" {} {} seed {} sigma {}", row.network->loaded.checksum,
                       ObjectModeName(row.mode), options_.seed, options_.sigma);
  }
  return Checksum(all);
}

std::optional<SynthesisSample> SynthesisStudy::Load(const SynthesisRow& row, int repeat, int first,
                                                    int count) const {
  const fs::path file = BlockFile(row, repeat, first);
  if (!fs::exists(file)) return std::nullopt;
  const SafetensorsReader reader(file);
  const auto question = reader.Metadata().find("question");
  const bool is_asked =
      question != reader.Metadata().end() && question->second == Question(row, repeat);
  SynthesisSample sample;
  const auto take = [&] {
    const auto n = static_cast<std::size_t>(count);
    const auto matrix = [&](const char* name, std::size_t rows) -> Eigen::MatrixXd {
      const std::vector<double> values = Doubles(reader.Read(name), rows * n);
      return Eigen::Map<const Eigen::MatrixXd>(values.data(), static_cast<Eigen::Index>(rows),
                                               static_cast<Eigen::Index>(n));
    };
    sample.features = matrix("features", imos::kRecognizerFeatures).cast<float>();
    sample.errors = matrix("errors", 4);
    const nlohmann::json times = ReadJson(TimesFile(file));
    const auto seconds = times.at("seconds").get<std::vector<double>>();
    if (seconds.size() != 2 * n) return false;
    sample.seconds = Eigen::Map<const Eigen::Matrix2Xd>(seconds.data(), 2, count);
    sample.objects = matrix("objects", repeat == 0 ? SynthesisObjectKeys().size() : 0);
    for (const double label : Doubles(reader.Read("recognized"), n)) {
      sample.recognized.push_back(static_cast<int>(label));
    }
    return true;
  };
  if (!TakeBlock(file, is_asked, options_.force, "networks, action classifier, clips or seed",
                 take)) {
    return std::nullopt;
  }
  return sample;
}

void SynthesisStudy::Save(const SynthesisSample& sample, const SynthesisRow& row, int repeat,
                          int first) const {
  SafetensorsWriter writer;
  const auto n = static_cast<std::size_t>(sample.Count());
  // Case after case, which is how columns lie in memory.
  const auto add = [&](const char* name, const Eigen::Ref<const Eigen::MatrixXd>& values) {
    const Eigen::MatrixXd dense = values;
    writer.AddFloat64(name, {n, static_cast<std::size_t>(dense.rows())},
                      {dense.data(), static_cast<std::size_t>(dense.size())});
  };
  writer.AddFloat32("features", {n, static_cast<std::size_t>(sample.features.rows())},
                    {sample.features.data(), static_cast<std::size_t>(sample.features.size())});
  add("errors", sample.errors);
  add("objects", sample.objects);
  const std::vector<std::int64_t> labels(sample.recognized.begin(), sample.recognized.end());
  writer.AddInt64("recognized", {n}, labels);
  writer.SetMetadata({{"format", kBlockFormat}, {"question", Question(row, repeat)}});
  const fs::path file = BlockFile(row, repeat, first);
  const auto seconds = sample.seconds.reshaped();
  WriteAtomically(
      TimesFile(file),
      nlohmann::json{{"seconds", std::vector<double>(seconds.begin(), seconds.end())}}.dump() +
          "\n");
  writer.Write(file);
}

std::vector<SynthesizedCase> SynthesisStudy::MakeCases(const SynthesisRow& row, int repeat,
                                                       int first, int count) {
  const std::span<const SynthesisCase> cases = cases_.subspan(first, count);
  if (row.kind == RowKind::kNetwork) {
    SynthesisOrder order;
    order.mode = row.mode;
    order.seed = options_.seed;
    order.repeat = repeat;
    order.total = static_cast<int>(cases_.size());
    order.first = first;
    order.sigma = options_.sigma;
    order.timed = repeat == 0;
    for (int i = first; i < first + count; ++i) order.finish.push_back(MeasuresObject(repeat, i));
    order.threads = options_.threads;
    order.stopped = stopped_;
    return SynthesizeCases(*row.network, cases, order, library_);
  }
  std::vector<SynthesizedCase> made;
  for (const SynthesisCase& one : cases) {
    made.push_back({row.kind == RowKind::kStill ? HeldStill(one) : one.keys, {}, 0.0, 0.0});
    if (row.kind == RowKind::kClip) made.back().finished = one.scene.clip;
  }
  return made;
}

Eigen::VectorXd SynthesisStudy::MeasureObject(const SynthesisRow& row, const SynthesisCase& one,
                                              const SynthesizedCase& made) const {
  ClipScene scene = one.scene;
  scene.clip = made.finished ? *made.finished : ResampleSmoothly(made.keys, kRate_Hz);
  if (options_.keep_clips && row.kind != RowKind::kClip) {
    const std::string mode = row.network ? ObjectModeName(row.mode) + "_" : "";
    const fs::path folder = folder_ / "clips" / (mode + row.key) / one.sequence.subject;
    fs::create_directories(folder);
    Clip kept = scene.clip;
    // Embedded objects are found by name from wherever the clip is.
    if (const fs::path mesh = fs::path(one.sequence.source).parent_path() / kept.object->mesh;
        fs::exists(mesh)) {
      kept.object->mesh = fs::absolute(mesh).string();
    }
    WriteClip(kept, folder / (one.sequence.name + ".npz"));
  }
  scene.object = LoadObject(scene.object_source).mesh;
  const ScoreOptions options = WithoutVolumes();
  const MetricValues values =
      ClipValues(ScoreClip(scene, nullptr, options, [&](auto...) { return !stopped_(); }), options);
  Eigen::VectorXd numbers(SynthesisObjectKeys().size());
  for (Eigen::Index k = 0; k < numbers.size(); ++k) {
    numbers[k] = values.at(SynthesisObjectKeys()[k]).value_or(kUndefined);
  }
  return numbers;
}

SynthesisSample SynthesisStudy::Make(const SynthesisRow& row, int repeat, int first, int count) {
  const std::vector<SynthesizedCase> made = MakeCases(row, repeat, first, count);
  SynthesisSample sample;
  if (stopped_()) return sample;
  sample.errors.resize(4, count);
  sample.seconds.resize(2, count);
  sample.objects.setConstant(repeat == 0 ? SynthesisObjectKeys().size() : 0, count, kUndefined);
  std::vector<imos::JointMotion> joints(made.size());
  ParallelFor(count, options_.threads, [&](int i) {
    const SynthesisCase& one = cases_[first + i];
    joints[i] = JointsOf(made[i].keys, one);
    sample.errors.col(i) << imos::MeanJointError(joints[i], one.sequence.joints),
        imos::AverageVarianceErrorOfCode(joints[i], one.sequence.joints),
        imos::AverageVarianceError(joints[i], one.sequence.joints),
        imos::FaceError(ObjectFromHead(made[i].keys, one), ObjectFromHead(one.keys, one),
                        imos::kHistory)
            .value_or(kUndefined);
    sample.seconds.col(i) << made[i].seconds, made[i].finishing_seconds;
    if (MeasuresObject(repeat, first + i) && !stopped_())
      sample.objects.col(i) = MeasureObject(row, one, made[i]);
  });
  imos::Recognition seen = recognizer_.Recognize(joints, options_.threads);
  sample.features = std::move(seen.features);
  sample.recognized = std::move(seen.labels);
  return sample;
}

int SynthesisStudy::NumDone(const SynthesisRow& row, int repeat) const {
  const int total = static_cast<int>(cases_.size()), size = BlockSize(row, repeat);
  int done = 0;
  for (int first = 0; first < total; first += size) {
    const int count = std::min(size, total - first);
    if (Load(row, repeat, first, count)) done += count;
  }
  return done;
}

std::optional<SynthesisSample> SynthesisStudy::RunRepeat(const SynthesisRow& row, int repeat,
                                                         const std::function<void(int)>& progress) {
  const int total = static_cast<int>(cases_.size()), size = BlockSize(row, repeat);
  SynthesisSample all;
  for (int first = 0; first < total; first += size) {
    const int count = std::min(size, total - first);
    std::optional<SynthesisSample> block = Load(row, repeat, first, count);
    if (!block) {
      block = Make(row, repeat, first, count);
      if (stopped_()) return std::nullopt;  // what was cut short is not kept
      Save(*block, row, repeat, first);
      progress(count);
    }
    all.Append(*block);
  }
  return all;
}

int SynthesisStudy::Repeats(const SynthesisRow& row) const {
  if (!row.IsRandom()) return 1;
  return row.mode == ObjectMode::kFitted ? options_.fitted_repeats : options_.repeats;
}

SynthesisStudy::Motions SynthesisStudy::Count(std::span<const SynthesisRow> rows) const {
  Motions count;
  for (const SynthesisRow& row : rows) {
    for (int repeat = 0; repeat < Repeats(row); ++repeat) {
      const int cases = static_cast<int>(cases_.size());
      count.total += cases;
      count.left += cases - NumDone(row, repeat);
    }
  }
  return count;
}

std::vector<SynthesisResult> SynthesisStudy::Run(std::span<const SynthesisRow> rows,
                                                 const std::function<void(int)>& progress) {
  std::vector<SynthesisResult> results;
  SynthesisSample real;
  int made = 0;
  for (const SynthesisRow& row : rows) {
    std::vector<SynthesisSample> samples;
    for (int repeat = 0; repeat < Repeats(row); ++repeat) {
      std::optional<SynthesisSample> sample =
          RunRepeat(row, repeat, [&](int more) { progress(made += more); });
      if (!sample) return {};
      samples.push_back(std::move(*sample));
    }
    if (row.kind == RowKind::kReal) real = samples[0];
    results.push_back(
        {row, SummarizeSynthesis(row, samples, real, cases_, options_.repeats, options_.seed)});
  }
  AddMeansOverSeeds(results);
  return results;
}

}  // namespace holdfast
