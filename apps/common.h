// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/error.h"
#include "geometry/mesh/mesh.h"
#include "geometry/object/load_object.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "geometry/retarget/retarget.h"
#include "solver/fit/prepared_object.h"

namespace holdfast::apps {

/// Exit codes of all commands.
inline constexpr int kDone = 0;
inline constexpr int kInputFault = 1;
inline constexpr int kUsageFault = 2;
inline constexpr int kFitFault = 3;
inline constexpr int kInterrupted = 130;

/// Help for arguments that LoadObject reads.
inline constexpr const char* kObjectHelp =
    "Mesh (.obj .ply .stl .off .glb .gltf .dae .urdf), in meters, or embedded object";

/// Result of a command.
struct Outcome {
  int exit_code = kDone;
  nlohmann::json summary;  ///< printed by --json
  std::string text;        ///< human-readable summary
};

/// Options of all commands.
struct CommonOptions {
  bool json = false;         ///< prints the summary as JSON on stdout
  bool quiet = false;        ///< no progress or notes on stderr, but warnings
  bool verbose = false;      ///< details on stderr
  std::string log = "text";  ///< of stderr: "text", "json" (one object per line), "none" (errors)
  bool force = false;        ///< overwrites existing files
  int threads = 0;           ///< 0: all cores
  std::uint64_t seed = 1;    ///< of all random draws
};

/// Adds --json, --quiet, --verbose, --log, --threads, --seed (and --force if `writes`), --config
/// and --print-config, and appends `examples` to --help.
void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples);

/// Adds an option with its default in --help, and checks on its value.
template <typename Value, typename... Checks>
CLI::Option* AddOption(CLI::App& command, const char* names, Value& value, const std::string& help,
                       const Checks&... checks) {
  CLI::Option* const option = command.add_option(names, value, help)->capture_default_str();
  (option->check(checks), ...);
  return option;
}

/// Adds all options of a job's table, with their help, config-file keys and checks.
void AddOptions(CLI::App& command, const OptionTable& table);

int NumThreads(const CommonOptions& options);

/// Set by Ctrl-C. Long computations check it between frames and stop cleanly.
bool Interrupted();

/// Writes a line to stderr with --log json: time (UTC), level ("debug", "info", "warning",
/// "error"), event and `fields`. Events are listed in docs/commands.md.
void LogJson(std::string_view level, std::string_view event, const nlohmann::ordered_json& fields);

/// Prints a note on stderr unless quiet. The prefix "warning: " makes it a warning, which is
/// printed in any case but with --log none.
void Note(const CommonOptions& options, std::string_view text);

/// Warns if a network's notes record a different rest pelvis (OldPelvisWarning).
void WarnOfOldPelvis(const std::string& source, const std::map<std::string, std::string>& notes,
                     const CommonOptions& options);

/// Prints --verbose details: `text`, or the event with its fields.
void Detail(const CommonOptions& options, std::string_view event, std::string_view text,
            const nlohmann::ordered_json& fields);

/// Progress on stderr with the remaining time: one updated line on a terminal, a few lines in a
/// log. With --verbose, the elapsed time is printed at the end.
class Progress {
 public:
  Progress(const CommonOptions& options, std::string label);
  ~Progress();
  void Update(int done, int total);

 private:
  const CommonOptions& options_;
  bool terminal_;
  bool line_open_ = false;
  int done_ = 0, total_ = 0;
  std::string label_;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point last_;
};

/// Progress of multi-stage work, one line per stage.
class StageProgress {
 public:
  explicit StageProgress(const CommonOptions& options) : options_(options) {}
  void Update(const char* stage, int done, int total) {
    if (!line_ || stage_ != stage) {
      stage_ = stage;
      line_.emplace(options_, stage_);
    }
    line_->Update(done, total);
  }
  void End() { line_.reset(); }

 private:
  const CommonOptions& options_;
  std::string stage_;
  std::optional<Progress> line_;
};

/// Runs work that takes a StagedProgress and throws WorkStopped when it is stopped; its progress is
/// shown. Returns nothing after Ctrl-C.
template <typename Work>
auto RunStaged(const CommonOptions& options, const Work& work)
    -> std::optional<decltype(work(StagedProgress()))> {
  StageProgress progress(options);
  try {
    return work([&](const char* stage, int done, int total) {
      progress.Update(stage, done, total);
      return !Interrupted();
    });
  } catch (const WorkStopped&) {
    return std::nullopt;
  }
}

/// Loads the body model in a file, or the embedded one if `path` is empty.
std::shared_ptr<const BodyModel> LoadBody(const std::string& path);

/// Reads `count` finite numbers with commas between them and nothing else, such as "1.5,1.0,1.1";
/// nothing for other texts.
std::optional<std::vector<double>> NumbersFrom(std::string_view text, std::size_t count);

/// Throws Error unless `path` is new or --force is given, and a file can be written there. Called
/// before the work. Missing parent folders are created when the file is written.
void RequireNew(const std::filesystem::path& path, const CommonOptions& options);

/// Same, for a folder.
void RequireNewFolder(const std::filesystem::path& path, const CommonOptions& options);

/// Returns schema, version and seed: the head of all JSON output.
nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options);

/// During its lifetime this thread runs one job of a batch: PrintResult stores the summary here and
/// prints nothing, and results have no times, so that equal jobs give equal bytes.
class ResultCapture {
 public:
  ResultCapture();
  ~ResultCapture();
  ResultCapture(const ResultCapture&) = delete;
  ResultCapture& operator=(const ResultCapture&) = delete;
  const nlohmann::json& Summary() const { return summary_; }

 private:
  friend void PrintResult(const CommonOptions&, const nlohmann::json&, std::string_view);
  nlohmann::json summary_;
};

/// Returns whether this thread runs a job of a batch.
bool InBatch();

/// Prints `summary` as JSON if requested, otherwise `text`. Also ends --log json.
void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text);

// One function per command, each in its own file, which adds the command to the program. The
// command's callback writes its exit code.
void AddFitCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library);
void AddGraspCommand(CLI::App& app, int& exit_code);
void AddImportCommand(CLI::App& app, int& exit_code);
void AddConvertCommand(CLI::App& app, int& exit_code);
void AddDecimateCommand(CLI::App& app, int& exit_code);
void AddBodyCommand(CLI::App& app, int& exit_code);
void AddRenderCommand(CLI::App& app, int& exit_code);
void AddScoreCommand(CLI::App& app, int& exit_code);
void AddDoctorCommand(CLI::App& app, int& exit_code);
void AddSolveCommand(CLI::App& app, int& exit_code);
void AddExportCommand(CLI::App& app, int& exit_code);
void AddOffhandCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library);
void AddTransferCommand(CLI::App& app, int& exit_code);
void AddReportCommand(CLI::App& app, int& exit_code);
void AddRefineCommand(CLI::App& app, int& exit_code);
void AddMakeReachDataCommand(CLI::App& app, int& exit_code);
void AddMakeActionsCommand(CLI::App& app, int& exit_code);
void AddReachCommand(CLI::App& app, int& exit_code);
void AddSynthesizeCommand(CLI::App& app, int& exit_code);
void AddImportWeightsCommand(CLI::App& app, int& exit_code);

}  // namespace holdfast::apps
