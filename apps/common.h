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
#include "geometry/io/mesh/load_object.h"
#include "geometry/mesh/mesh.h"
#include "geometry/options.h"
#include "geometry/retarget/retarget.h"
#include "solver/fit/prepared_object.h"

namespace holdfast::apps {

/// Exit codes of every command.
inline constexpr int kDone = 0;
inline constexpr int kInputFault = 1;
inline constexpr int kUsageFault = 2;
inline constexpr int kFitFault = 3;
inline constexpr int kInterrupted = 130;

/// What came of a command's work.
struct Outcome {
  int exit_code = kDone;
  nlohmann::json summary;  ///< for machines: what --json prints
  std::string text;        ///< for people
};

/// Options that every command has.
struct CommonOptions {
  bool json = false;         ///< the summary as JSON on stdout
  bool quiet = false;        ///< no progress, no notes on stderr
  bool verbose = false;      ///< details on stderr
  std::string log = "text";  ///< what stderr is made of: "text", or "json", an object a line
  bool force = false;        ///< overwrite what is there
  int threads = 0;           ///< 0: all cores
  std::uint64_t seed = 1;    ///< of every random draw
};

/// Adds --json, --quiet, --verbose, --log, --threads, --seed (and --force where `writes`), --config
/// and --print-config, and `examples` to --help.
void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples);

/// An option that shows its default in --help, and what its value has to pass.
template <typename Value, typename... Checks>
CLI::Option* AddOption(CLI::App& command, const char* names, Value& value, const std::string& help,
                       const Checks&... checks) {
  CLI::Option* const option = command.add_option(names, value, help)->capture_default_str();
  (option->check(checks), ...);
  return option;
}

/// Adds all options of a job's table: --help, config files and their checks come from it.
void AddOptions(CLI::App& command, const OptionTable& table);

int NumThreads(const CommonOptions& options);

/// Set by Ctrl-C; long work looks at it between frames and stops cleanly.
bool Interrupted();

/// One line on stderr of --log json: time (UTC), level ("debug", "info", "warning", "error"), event
/// and `fields`. docs/commands.md has the events.
void LogJson(std::string_view level, std::string_view event, const nlohmann::ordered_json& fields);

/// A note for people, on stderr; nothing when quiet. "warning: " before it makes it a warning.
void Note(const CommonOptions& options, std::string_view text);

/// Warns of a network's notes that tell of another rest pelvis (OldPelvisWarning).
void WarnOfOldPelvis(const std::string& source, const std::map<std::string, std::string>& notes,
                     const CommonOptions& options);

/// What --verbose adds: `text`, or the event with its fields.
void Detail(const CommonOptions& options, std::string_view event, std::string_view text,
            const nlohmann::ordered_json& fields);

/// Progress on stderr: one line rewritten on a terminal, a few lines into a log; with time left.
/// With --verbose it ends with the time that it took.
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

/// Progress of work in stages, a line each.
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

/// The body model in a file, or the embedded one when `path` is empty.
std::shared_ptr<const BodyModel> LoadBody(const std::string& path);

/// Before the work: throws Error unless the file `path` is new or --force was given, and can be
/// written there. Folders above it that do not exist are made when it is written.
void RequireNew(const std::filesystem::path& path, const CommonOptions& options);

/// The same for a folder.
void RequireNewFolder(const std::filesystem::path& path, const CommonOptions& options);

/// schema, version, seed: the head of every JSON that is written.
nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options);

/// While one lives, this thread runs one job of many: PrintResult keeps the summary here and prints
/// nothing, and results are written without times, so that equal jobs end in equal bytes.
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

/// Whether this thread runs one job of many.
bool InBatch();

/// Prints `summary` as JSON when asked for, otherwise `text`; it ends --log json, too.
void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text);

// One function per command, each in a file of its own: adds it to the program. The command's
// callback writes its exit code.
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
