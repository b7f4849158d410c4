// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/naturalness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "generator/scripted/reach_motion.h"
#include "generator/walk_statistics/set_spread.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr double kMotionRate = 30.0;   // Hz
constexpr std::size_t kCompared = 64;  // motions of a set, pair by pair
constexpr double kFarthest = 5.0;      // that a measure counts in the mean distance
constexpr int kHandDraws = 500'000;    // apart from the draws of the body's measures

// `progress` asked for an end.
struct NaturalnessStopped {};

// A motion as MeasureStyle takes it. `body.surface` points into `surface`.
struct LoadedMotion {
  std::vector<BodyFrame> frames;  // at 30 Hz
  StyleBody body;                 // without limits
  std::shared_ptr<const wandr::LowestPoint> surface;
  bool other_shape = false;           // it has a shape that is not this body model's: not used
  std::vector<std::string> warnings;  // of reading it
};

// Reads motions with the bodies of those who move.
class MotionReader {
 public:
  explicit MotionReader(std::shared_ptr<const BodyModel> model)
      : model_(std::move(model)), mean_(Make(model_, {})) {}

  const Eigen::Matrix3Xd& MeanJoints() const { return mean_.measures.rest_joints; }

  LoadedMotion Read(const MotionFile& file) const {
    ImportFileOptions import;
    import.parameters.body = model_;
    LoadedClip loaded = LoadClip(file.path, std::move(import));
    LoadedMotion motion;
    for (const std::string& note : loaded.notes) {
      if (note.starts_with("warning: ")) {
        motion.warnings.push_back(note.substr(9));
      }
    }
    Clip& clip = loaded.clip;
    const ClipBody& body = loaded.body;
    if (clip.frame_rate != kMotionRate) clip = Resample(clip, kMotionRate);
    const bool is_mean = body.model == model_ && (body.betas.size() == 0 || body.betas.isZero(0.0));
    const Person person = is_mean ? mean_ : Make(body.model, body.betas);
    motion.body.rest_joints = person.measures.rest_joints;
    motion.body.sole_y = person.measures.sole_y;
    motion.surface = person.surface;
    motion.body.surface = motion.surface.get();
    motion.frames = BodyFrames(clip, motion.body.rest_joints);
    motion.other_shape = is_mean && clip.betas.size() > 0 && !clip.betas.isZero(0.0);
    return motion;
  }

 private:
  struct Person {
    BodyMeasures measures;
    std::shared_ptr<const wandr::LowestPoint> surface;
  };
  static Person Make(const std::shared_ptr<const BodyModel>& model, const Eigen::VectorXd& betas) {
    return {MeasureBody(*model, betas),
            std::make_shared<const wandr::LowestPoint>(BodySurface(model, betas))};
  }

  std::shared_ptr<const BodyModel> model_;
  Person mean_;  // of the mean shape, made once
};

// Reads and measures all motions.
class StyleMeasurement {
 public:
  StyleMeasurement(const std::vector<MotionSet>& sets, const NaturalnessOptions& options)
      : sets_(sets),
        options_(options),
        reader_(options.body ? options.body : BodyModel::Default()) {
    for (const MotionSet& set : sets) total_ += static_cast<int>(set.files.size());
  }

  void Run(NaturalnessStudy& study) {
    // The reference first, all of it: joint limits are taken from it.
    std::vector<LoadedMotion> captured(sets_[0].files.size());
    ForAll(captured.size(), 0, [&](int i) { captured[i] = reader_.Read(sets_[0].files[i]); });
    const JointLimits limits = Limits(captured);
    for (const MotionSet& set : sets_) {
      const bool is_reference = &set == sets_.data();
      std::vector<MotionStyle> styles(set.files.size());
      std::vector<std::vector<BodyFrame>> compared(std::min(set.files.size(), kCompared));
      ForAll(set.files.size(), 1, [&](int i) {
        LoadedMotion loaded;
        if (!is_reference) loaded = reader_.Read(set.files[i]);
        LoadedMotion& motion = is_reference ? captured[i] : loaded;
        motion.body.limits = &limits;
        styles[i] = MeasureStyle(motion.frames, motion.body);
        const std::size_t all = set.files.size(), k = i * compared.size() / all;
        if (static_cast<std::size_t>(i) == (k * all + compared.size() - 1) / compared.size()) {
          compared[k] = motion.frames;
        }
        const std::lock_guard lock(mutex_);
        other_shapes_ += motion.other_shape ? 1 : 0;
        for (const std::string& warning : motion.warnings) ++warnings_[warning];
      });
      study.columns.push_back(ColumnOf(set, std::move(styles)));
      study.columns.back().pair_distance_m = SetSpread(compared, reader_.MeanJoints());
    }
  }

  int OtherShapes() const { return other_shapes_; }
  /// What is doubtful about files, and of how many.
  const std::map<std::string, int>& Warnings() const { return warnings_; }

 private:
  // Each of them adds `counts` to what is done.
  template <typename Work>
  void ForAll(std::size_t count, int counts, const Work& work) {
    ParallelFor(static_cast<int>(count), options_.threads, [&](int i) {
      work(i);
      const std::lock_guard lock(mutex_);
      done_ += counts;
      if (options_.progress && !options_.progress(done_, total_)) throw NaturalnessStopped();
    });
  }

  JointLimits Limits(const std::vector<LoadedMotion>& reference) {
    const std::vector<MotionFile>& files = options_.limits.files;
    std::vector<std::vector<BodyFrame>> frames(files.size());
    ForAll(files.size(), 0, [&](int i) { frames[i] = reader_.Read(files[i]).frames; });
    if (files.empty()) {
      for (const LoadedMotion& motion : reference) frames.push_back(motion.frames);
    }
    return LimitsOf(frames);
  }

  NaturalnessColumn ColumnOf(const MotionSet& set, std::vector<MotionStyle> styles) const {
    NaturalnessColumn column;
    column.set.label = set.label;
    column.set.least_way_m = options_.least_way_m;
    for (std::size_t i = 0; i < styles.size(); ++i) {
      if (options_.moving_only && styles[i].way_m < options_.least_way_m) continue;
      column.set.motions.push_back(std::move(styles[i]));
      column.files.push_back(set.files[i].name);
    }
    if (column.set.motions.empty()) {
      throw Error(set.label,
                  fmt::format("none of its {} motions gets {:g} m away", set.files.size(),
                              options_.least_way_m),
                  "Give others, a smaller --way, or leave out --moving-only");
    }
    return column;
  }

  const std::vector<MotionSet>& sets_;
  const NaturalnessOptions& options_;
  MotionReader reader_;
  std::mutex mutex_;
  int done_ = 0, total_ = 0, other_shapes_ = 0;
  std::map<std::string, int> warnings_;
};

struct MeanDistance {
  double distance = 0.0, by_chance = 0.0;
};

// Over these measures of those that have one.
MeanDistance MeanOver(const NaturalnessColumn& column, int begin, int end) {
  MeanDistance mean;
  int count = 0;
  for (int m = begin; m < end; ++m) {
    const StyleDistance& one = column.distance[static_cast<std::size_t>(m)];
    if (!std::isfinite(one.distance)) continue;
    mean.distance += std::min(one.distance, kFarthest);
    mean.by_chance += std::min(one.by_chance, kFarthest);
    ++count;
  }
  mean.distance /= std::max(count, 1);
  mean.by_chance /= std::max(count, 1);
  return mean;
}

void CompareColumns(const NaturalnessOptions& options, NaturalnessStudy& study) {
  const int columns = static_cast<int>(study.columns.size()), measures = study.NumMeasures();
  for (NaturalnessColumn& column : study.columns) {
    for (int m = 0; m < measures; ++m) {
      column.spread[static_cast<std::size_t>(m)] =
          SpreadOf(ValuesOf(column.set, static_cast<StyleMeasure>(m)));
    }
  }
  const NaturalnessColumn& reference = study.columns[0];
  for (NaturalnessColumn& column : study.columns) {
    for (const MotionStyle& motion : column.set.motions) {
      column.oddness.push_back(OddnessOf(motion, column.set, reference.spread));
    }
  }
  // One draw of its own for every cell: results do not depend on who computes which, nor those of
  // the body on whether the hand's are asked for.
  ParallelFor(columns * measures, options.threads, [&](int cell) {
    const int c = cell / measures, m = cell % measures;
    NaturalnessColumn& column = study.columns[static_cast<std::size_t>(c)];
    const auto measure = static_cast<StyleMeasure>(m);
    const std::vector<double> others =
        &column == &reference ? std::vector<double>() : ValuesOf(column.set, measure);
    const int draw = m < kNumBodyMeasures ? c * kNumBodyMeasures + m : kHandDraws + cell;
    column.distance[static_cast<std::size_t>(m)] =
        DistanceOf(ValuesOf(reference.set, measure), others,
                   StyleMeasures()[static_cast<std::size_t>(m)].resolution,
                   options.seed * 1'000'003 + static_cast<std::uint64_t>(draw));
  });
  for (NaturalnessColumn& column : study.columns) {
    const MeanDistance body = MeanOver(column, 0, kNumBodyMeasures);
    column.mean_distance = body.distance;
    column.mean_by_chance = body.by_chance;
    if (!study.hands) continue;
    const MeanDistance hand = MeanOver(column, kNumBodyMeasures, kNumStyleMeasures);
    column.hand_distance = hand.distance;
    column.hand_by_chance = hand.by_chance;
  }
}

std::vector<std::string> NotesOf(const NaturalnessOptions& options, const NaturalnessStudy& study,
                                 int other_shapes) {
  std::vector<std::string> notes;
  notes.push_back(fmt::format(
      "Motions at 30 Hz on the ground z = 0; each counts once. Measures of walks ask those whose "
      "pelvis gets {:g} m or more from where it was{}.",
      options.least_way_m, options.moving_only ? "; others are left out of all" : ""));
  notes.push_back(
      "Distance: 1-Wasserstein distance of the motions' values to those of the reference (the "
      "first "
      "set), in deviations of the reference, a deviation being at least what an eye can tell. By "
      "chance: what 95 of 100 random deals of the same motions stay below.");
  notes.push_back(options.limits.files.empty()
                      ? "Joint limits are those of the reference."
                      : fmt::format("Joint limits are those of {}.", options.limits.label));
  for (const NaturalnessColumn& column : study.columns) {
    const auto cut = std::ranges::count_if(column.set.motions, &MotionStyle::cut);
    if (cut == 0) continue;
    notes.push_back(fmt::format("{}: {} motions have numbers that are none; measured until there.",
                                column.set.label, cut));
  }
  if (other_shapes > 0) {
    notes.push_back(
        fmt::format("{} motions have a shape of another body model: measured on the mean shape.",
                    other_shapes));
  }
  return notes;
}

}  // namespace

int NaturalnessColumn::NumCrouchingTwice() const {
  return static_cast<int>(std::ranges::count_if(
      set.motions, [](const MotionStyle& motion) { return motion.faults.CrouchesTwice(); }));
}

int NaturalnessColumn::NumLeaningBack() const {
  return static_cast<int>(std::ranges::count_if(
      set.motions, [](const MotionStyle& motion) { return motion.faults.LeansBack(); }));
}

int NaturalnessColumn::NumWalks() const {
  return static_cast<int>(std::ranges::count_if(
      set.motions, [&](const MotionStyle& motion) { return motion.way_m >= set.least_way_m; }));
}

double NaturalnessColumn::Minutes() const {
  double frames = 0.0;
  for (const MotionStyle& motion : set.motions) frames += motion.frames;
  return frames / kMotionRate / 60.0;
}

std::vector<StyleMeasure> SetApartBy(const NaturalnessColumn& column) {
  std::vector<std::pair<double, int>> order;
  for (int m = 0; m < kNumStyleMeasures; ++m) {
    const StyleDistance& distance = column.distance[static_cast<std::size_t>(m)];
    if (distance.Shown()) order.emplace_back(-distance.distance, m);
  }
  std::ranges::sort(order);
  std::vector<StyleMeasure> measures;
  for (const auto& [distance, m] : order) measures.push_back(static_cast<StyleMeasure>(m));
  return measures;
}

std::vector<int> OddestMotions(const NaturalnessColumn& column, int count) {
  std::vector<int> order;
  for (int i = 0; i < column.NumMotions(); ++i) {
    if (std::isfinite(column.oddness[static_cast<std::size_t>(i)].value)) order.push_back(i);
  }
  std::ranges::stable_sort(order, [&](int a, int b) {
    return column.oddness[static_cast<std::size_t>(a)].value >
           column.oddness[static_cast<std::size_t>(b)].value;
  });
  if (static_cast<int>(order.size()) > count) order.resize(static_cast<std::size_t>(count));
  return order;
}

NaturalnessStudy CompareNaturalness(const std::vector<MotionSet>& sets,
                                    const NaturalnessOptions& options) {
  NaturalnessStudy study;
  study.hands = options.hands;
  StyleMeasurement measurement(sets, options);
  try {
    measurement.Run(study);
  } catch (const NaturalnessStopped&) {
    study.stopped = true;
    return study;
  }
  CompareColumns(options, study);
  study.notes = NotesOf(options, study, measurement.OtherShapes());
  for (const auto& [warning, files] : measurement.Warnings()) {
    study.notes.push_back(fmt::format("In {} files: {}.", files, warning));
  }
  return study;
}

}  // namespace holdfast
