// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/error.h"
#include "geometry/mesh/mesh.h"
#include "geometry/retarget/retarget.h"

namespace holdfast::apps {

/// Exit codes of every command.
inline constexpr int kDone = 0;
inline constexpr int kInputFault = 1;
inline constexpr int kUsageFault = 2;
inline constexpr int kFitFault = 3;
inline constexpr int kInterrupted = 130;

/// The input is sound, yet there is no result: exit code 3.
struct FitFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Options that every command has.
struct CommonOptions {
  bool json = false;       ///< the summary as JSON on stdout
  bool quiet = false;      ///< no progress, no notes on stderr
  bool force = false;      ///< overwrite what is there
  int threads = 0;         ///< 0: all cores
  std::uint64_t seed = 1;  ///< of every random draw
};

/// Adds --json, --quiet, --threads, --seed (and --force where `writes`), and `examples` to --help.
void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples);

int NumThreads(const CommonOptions& options);

/// Set by Ctrl-C; long work looks at it between frames and stops cleanly.
bool Interrupted();

/// A note for people, on stderr; nothing when quiet.
void Note(const CommonOptions& options, std::string_view text);

/// Progress on stderr: one line rewritten on a terminal, a few lines into a log; with time left.
class Progress {
 public:
  Progress(const CommonOptions& options, std::string label);
  ~Progress();
  void Update(int done, int total);

 private:
  bool shown_;
  bool terminal_;
  bool line_open_ = false;
  std::string label_;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point last_;
};

/// The body model in a file, or the embedded one when `path` is empty.
std::shared_ptr<const BodyModel> LoadBody(const std::string& path);

/// An object ready for fitting.
struct LoadedObject {
  std::string name;               ///< stem of the file, or the embedded object's name
  std::string source;             ///< as the user wrote it
  TriangleMesh mesh;              ///< repaired where that is safe, scaled
  bool implausible_size = false;  ///< not a handheld object in metres
  double suggested_scale = 1.0;   ///< then, the factor that would make it one, if there is one
  std::vector<std::string> notes;
};

/// A mesh by path, or an embedded object by name ("mug"). What was repaired, and what is wrong and
/// could not be, is in `notes`. Throws Error listing the embedded names when it is neither.
LoadedObject LoadObject(const std::string& path_or_name, double scale = 1.0);

/// What `work` gives; an Error of it about "mesh" is thrown on as one about `source`.
template <typename Work>
auto NamingMesh(const std::string& source, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.Where() != "mesh") throw;
    throw Error(source, error.Problem(), error.Remedy());
  }
}

/// Throws Error for an object that is no size for a hand, with the scale that would help.
void RequireHandheld(const LoadedObject& object);

/// 300 (or `vertices`) vertices for the fit: the mesh itself when it has no more.
TriangleMesh ForFitting(const LoadedObject& object, int vertices, std::vector<std::string>* notes);

/// Before the work: throws Error unless the file `path` is new or --force was given, and can be
/// written there. Folders above it that do not exist are made when it is written.
void RequireNew(const std::filesystem::path& path, const CommonOptions& options);

/// The same for a folder.
void RequireNewFolder(const std::filesystem::path& path, const CommonOptions& options);

/// schema, version, seed: the head of every JSON that is written.
nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options);

/// Prints `summary` as JSON when asked for, otherwise `text`.
void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text);

// One function per command, each in a file of its own: adds it to the program. The command's
// callback writes its exit code.
void AddFitCommand(CLI::App& app, int& exit_code);
void AddGraspCommand(CLI::App& app, int& exit_code);
void AddImportCommand(CLI::App& app, int& exit_code);
void AddConvertCommand(CLI::App& app, int& exit_code);
void AddDecimateCommand(CLI::App& app, int& exit_code);
void AddBodyCommand(CLI::App& app, int& exit_code);
void AddRenderCommand(CLI::App& app, int& exit_code);
void AddScoreCommand(CLI::App& app, int& exit_code);
void AddDoctorCommand(CLI::App& app, int& exit_code);
void AddExportCommand(CLI::App& app, int& exit_code);
void AddOffhandCommand(CLI::App& app, int& exit_code);
void AddEvaluateCommand(CLI::App& app, int& exit_code);
void AddReportCommand(CLI::App& app, int& exit_code);
void AddRefineCommand(CLI::App& app, int& exit_code);
void AddMakeReachDataCommand(CLI::App& app, int& exit_code);
void AddMakeActionsCommand(CLI::App& app, int& exit_code);
void AddReachCommand(CLI::App& app, int& exit_code);
void AddSynthesizeCommand(CLI::App& app, int& exit_code);
void AddTrainCommand(CLI::App& app, int& exit_code);
void AddImportWeightsCommand(CLI::App& app, int& exit_code);

}  // namespace holdfast::apps
