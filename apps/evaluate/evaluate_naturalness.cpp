// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_naturalness.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/evaluate/naturalness_page.h"
#include "apps/interrupt.h"
#include "apps/motion_set.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

std::string FolderName(const std::string& path) {
  fs::path name = fs::path(path).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();
  return name.filename().string();
}

// "LABEL=PATH", or a path that may have '=' in it. Sets come in the order they are named first.
std::vector<MotionSet> SetsOf(const EvaluateNaturalnessOptions& options) {
  std::vector<MotionSet> sets(1);
  sets[0].label = "captured";
  const auto add = [](MotionSet& set, const std::string& path) {
    const std::vector<MotionFile> files = MotionFilesOf(path);
    set.files.insert(set.files.end(), files.begin(), files.end());
  };
  for (const std::string& path : options.reference) add(sets[0], path);
  for (const std::string& text : options.against) {
    const std::size_t equals = text.find('=');
    const bool labelled = equals != std::string::npos && !fs::exists(text);
    const std::string path = labelled ? text.substr(equals + 1) : text;
    const std::string label = labelled ? text.substr(0, equals) : FolderName(path);
    if (label.empty() || path.empty()) {
      throw Error("--against " + text, "names no set", "Give LABEL=FOLDER or a folder");
    }
    const auto known = std::ranges::find(sets, label, &MotionSet::label);
    if (known == sets.begin()) {
      throw Error("--against " + text, "has the name of the reference",
                  "Give it a name of its own: LABEL=" + path);
    }
    add(known == sets.end() ? sets.emplace_back(MotionSet{label, {}}) : *known, path);
  }
  if (options.at_most > 0) {
    for (MotionSet& set : sets) {
      const std::size_t all = set.files.size(), some = static_cast<std::size_t>(options.at_most);
      if (all <= some) continue;
      for (std::size_t i = 0; i < some; ++i) set.files[i] = set.files[i * all / some];
      set.files.resize(some);
    }
  }
  return sets;
}

// All of a set, on several threads; `done` of `total` are those of all sets.
template <typename Work>
void ForAll(int count, const CommonOptions& common, Progress& progress, int& done, int total,
            const Work& work) {
  std::mutex mutex;
  ParallelFor(count, NumThreads(common), [&](int i) {
    if (Interrupted()) throw Stopped();
    work(i);
    const std::lock_guard lock(mutex);
    progress.Update(++done, total);
  });
}

// Joint limits of captured motion: that in `paths`, or else the reference.
JointLimits LimitsFrom(const std::vector<std::string>& paths,
                       const std::vector<LoadedMotion>& reference, const MotionReader& reader,
                       const CommonOptions& common) {
  std::vector<std::vector<BodyFrame>> frames;
  if (paths.empty()) {
    for (const LoadedMotion& motion : reference) frames.push_back(motion.frames);
    return LimitsOf(frames);
  }
  std::vector<MotionFile> files;
  for (const std::string& path : paths) {
    const std::vector<MotionFile> some = MotionFilesOf(path);
    files.insert(files.end(), some.begin(), some.end());
  }
  frames.resize(files.size());
  ParallelFor(static_cast<int>(files.size()), NumThreads(common), [&](int i) {
    if (Interrupted()) throw Stopped();
    frames[i] = reader.Read(files[i], common).frames;
  });
  return LimitsOf(frames);
}

void Compare(const EvaluateNaturalnessOptions& options, const CommonOptions& common,
             NaturalnessStudy& study) {
  const std::size_t columns = study.columns.size();
  for (NaturalnessColumn& column : study.columns) {
    column.set.least_way_m = options.least_way_m;
    for (int m = 0; m < kNumStyleMeasures; ++m) {
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
  // One draw of its own for every cell: results do not depend on who computes which.
  ParallelFor(static_cast<int>(columns) * kNumStyleMeasures, NumThreads(common), [&](int cell) {
    NaturalnessColumn& column = study.columns[static_cast<std::size_t>(cell / kNumStyleMeasures)];
    const auto m = static_cast<std::size_t>(cell % kNumStyleMeasures);
    const auto measure = static_cast<StyleMeasure>(m);
    const std::vector<double> others =
        &column == &reference ? std::vector<double>() : ValuesOf(column.set, measure);
    column.distance[m] =
        DistanceOf(ValuesOf(reference.set, measure), others, StyleMeasures()[m].resolution,
                   common.seed * 1'000'003 + static_cast<std::uint64_t>(cell));
  });
  for (NaturalnessColumn& column : study.columns) {
    int count = 0;
    for (const StyleDistance& distance : column.distance) {
      if (!std::isfinite(distance.distance)) continue;
      column.mean_distance += std::min(distance.distance, kFarthest);
      column.mean_by_chance += std::min(distance.by_chance, kFarthest);
      ++count;
    }
    column.mean_distance /= std::max(count, 1);
    column.mean_by_chance /= std::max(count, 1);
  }
}

std::vector<std::string> NotesOf(const EvaluateNaturalnessOptions& options,
                                 const NaturalnessStudy& study, int other_shapes) {
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
  notes.push_back(options.limits.empty() ? "Joint limits are those of the reference."
                                         : fmt::format("Joint limits are those of {}.",
                                                       fmt::join(options.limits, ", ")));
  const auto cut = [&](const NaturalnessColumn& column) {
    return std::ranges::count_if(column.set.motions, &MotionStyle::cut);
  };
  for (const NaturalnessColumn& column : study.columns) {
    if (cut(column) == 0) continue;
    notes.push_back(fmt::format("{}: {} motions have numbers that are none; measured until there.",
                                column.set.label, cut(column)));
  }
  if (other_shapes > 0) {
    notes.push_back(
        fmt::format("{} motions have a shape of another body model: measured on the mean shape.",
                    other_shapes));
  }
  return notes;
}

}  // namespace

FitOutcome EvaluateNaturalness(const EvaluateNaturalnessOptions& options,
                               const CommonOptions& common) {
  const fs::path folder = options.output;
  RequireNewFolder(folder, common);
  const std::vector<MotionSet> sets = SetsOf(options);
  const MotionReader reader(options.body);
  const int total = std::accumulate(sets.begin(), sets.end(), 0, [](int sum, const MotionSet& set) {
    return sum + static_cast<int>(set.files.size());
  });

  NaturalnessStudy study;
  std::atomic<int> other_shapes{0};
  try {
    Progress progress(common, "evaluate naturalness");
    int done = 0;
    // The reference first, all of it: joint limits are taken from it.
    std::vector<LoadedMotion> captured(sets[0].files.size());
    ParallelFor(static_cast<int>(captured.size()), NumThreads(common), [&](int i) {
      if (Interrupted()) throw Stopped();
      captured[i] = reader.Read(sets[0].files[i], common);
    });
    const JointLimits limits = LimitsFrom(options.limits, captured, reader, common);

    for (const MotionSet& set : sets) {
      const bool is_reference = &set == sets.data();
      std::vector<MotionStyle> styles(set.files.size());
      ForAll(static_cast<int>(set.files.size()), common, progress, done, total, [&](int i) {
        LoadedMotion loaded;
        if (!is_reference) loaded = reader.Read(set.files[i], common);
        LoadedMotion& motion = is_reference ? captured[i] : loaded;
        motion.body.limits = &limits;
        other_shapes += motion.other_shape ? 1 : 0;
        styles[i] = MeasureStyle(motion.frames, motion.body);
      });
      NaturalnessColumn& column = study.columns.emplace_back();
      column.set.label = set.label;
      for (std::size_t i = 0; i < styles.size(); ++i) {
        if (options.moving_only && styles[i].way_m < options.least_way_m) continue;
        column.set.motions.push_back(std::move(styles[i]));
        column.files.push_back(set.files[i].name);
      }
      if (column.set.motions.empty()) {
        throw Error(set.label,
                    fmt::format("none of its {} motions gets {:g} m away", set.files.size(),
                                options.least_way_m),
                    "Give others, a smaller --way, or leave out --moving-only");
      }
    }
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  Compare(options, common, study);
  study.notes = NotesOf(options, study, other_shapes);

  FitOutcome outcome;
  outcome.summary = JsonHead("holdfast/evaluate-naturalness/1", common);
  outcome.summary.update(NaturalnessJson(study));
  const std::string table = NaturalnessTable(study);
  fs::create_directories(folder);
  WriteAtomically(folder / "results.json", outcome.summary.dump(1) + "\n");
  WriteAtomically(folder / "results.md", table);
  WriteAtomically(folder / "motions.csv", NaturalnessCsv(study));
  WriteAtomically(folder / "report.html", NaturalnessPage(study));
  outcome.summary["output"] = options.output;
  outcome.text = fmt::format("{}\nresults.json, results.md, motions.csv and report.html in {}\n",
                             table, options.output);
  return outcome;
}

void AddEvaluateNaturalness(CLI::App& evaluate, int& exit_code) {
  struct Options {
    CommonOptions common;
    EvaluateNaturalnessOptions naturalness;
  };
  auto options = std::make_shared<Options>();
  EvaluateNaturalnessOptions& what = options->naturalness;
  CLI::App* command = evaluate.add_subcommand(
      "naturalness", "Compare sets of motions with captured ones: gait, posture, smoothness");
  command
      ->add_option("reference", what.reference,
                   "Captured clips, or folders of them (with all below), that others are compared "
                   "with; best of people no network was trained on")
      ->required();
  command
      ->add_option("--against", what.against,
                   "LABEL=CLIP or LABEL=FOLDER (with all below): a set to compare, a column of the "
                   "table. Repeated: further sets, or more of one label")
      ->allow_extra_args(false);
  command
      ->add_option("--limits", what.limits,
                   "Captured clips, or folders of them, that joint limits are taken from; the "
                   "reference where left out")
      ->allow_extra_args(false);
  command->add_option("--body", what.body, "Body model in place of the embedded one");
  command
      ->add_option("--way", what.least_way_m,
                   "Metres that a motion's pelvis must get away for measures of walks")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 100.0));
  command->add_flag("--moving-only", what.moving_only,
                    "Leave motions that do not get that far out of all measures");
  command->add_option("--at-most", what.at_most, "Motions of each set, spread evenly; 0: all")
      ->capture_default_str()
      ->check(CLI::Range(0, 1'000'000));
  command
      ->add_option("-o,--output", what.output,
                   "Folder to make: results.json, results.md, "
                   "motions.csv, report.html")
      ->required();
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast reach --goal 3,1,1.2 --samples 20 --all -o reached\n"
      "  holdfast evaluate naturalness reaches/captured/held_out --against reach=reached \\\n"
      "      -o out/natural\n"
      "  holdfast evaluate naturalness reaches/captured/held_out --at-most 200 \\\n"
      "      --against others=reaches/captured/train --against made=reaches/made \\\n"
      "      --limits reaches/captured/train -o out/natural_data\n"
      "Clips of another frame rate are resampled to "
      "30 Hz.\n");
  command->callback([options, &exit_code] {
    const FitOutcome outcome = EvaluateNaturalness(options->naturalness, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
