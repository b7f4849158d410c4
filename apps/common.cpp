// SPDX-License-Identifier: MIT
#include "apps/common.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/suggestion.h"
#include "geometry/embedded.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/parallel.h"

namespace holdfast::apps {

namespace fs = std::filesystem;

void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples) {
  command.add_flag("--json", options.json, "Print the summary as JSON");
  command.add_flag("--quiet,-q", options.quiet, "No progress and no notes on stderr");
  command
      .add_option("--threads", options.threads, "Threads; 0: all cores that the process may use")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  command.add_option("--seed", options.seed, "Seed of every random draw")->capture_default_str();
  if (writes) command.add_flag("--force,-f", options.force, "Overwrite what is there");
  command.footer(fmt::format("\nExamples:\n{}", examples));
}

int NumThreads(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return AvailableThreads();
}

void Note(const CommonOptions& options, std::string_view text) {
  if (!options.quiet) fmt::print(stderr, "{}\n", text);
}

Progress::Progress(const CommonOptions& options, std::string label)
    : shown_(!options.quiet),
      terminal_(::isatty(STDERR_FILENO) != 0),
      label_(std::move(label)),
      begin_(std::chrono::steady_clock::now()),
      last_(begin_) {}

Progress::~Progress() {
  if (line_open_) fmt::print(stderr, "\n");
}

void Progress::Update(int done, int total) {
  if (!shown_ || total <= 0) return;
  const auto now = std::chrono::steady_clock::now();
  const auto pause = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (now - last_ < pause && done < total) return;
  if (!terminal_ && now - begin_ < pause) return;  // short work leaves no trace in a log
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  const double left = done > 0 ? elapsed / done * (total - done) : 0.0;
  const std::string line = fmt::format("{}: {}/{}, {:.0f} s left", label_, done, total, left);
  if (terminal_) {
    fmt::print(stderr, "\r{:<78}", line);
    line_open_ = true;
  } else {
    fmt::print(stderr, "{}\n", line);
  }
}

std::shared_ptr<const BodyModel> LoadBody(const std::string& path) {
  return path.empty() ? BodyModel::Default() : BodyModel::Load(path);
}

LoadedObject LoadObject(const std::string& path_or_name, double scale) {
  std::vector<std::string> names = EmbeddedNames("objects", ".ply");
  std::erase_if(names, [](const std::string& name) { return name.ends_with("_300"); });
  const bool embedded = std::ranges::find(names, path_or_name) != names.end();
  LoadedObject object;
  object.source = path_or_name;
  MeshFile file;
  // A folder of an embedded object's name does not hide it.
  std::error_code ignored;
  if (fs::exists(path_or_name, ignored) && !(fs::is_directory(path_or_name, ignored) && embedded)) {
    object.name = fs::path(path_or_name).stem().string();
    file = ReadMeshFile(path_or_name);
  } else {
    if (!embedded) {
      throw Error(path_or_name, "is neither a file nor an embedded object",
                  fmt::format("{}Give a mesh (.obj .ply .stl .off), or one of: {}",
                              Suggestion(path_or_name, names), fmt::join(names, ", ")));
    }
    object.name = path_or_name;
    const EmbeddedFile inside = FindEmbedded(fmt::format("objects/{}.ply", path_or_name));
    file = ReadMeshBytes({reinterpret_cast<const char*>(inside.bytes.data()), inside.bytes.size()},
                         inside.name);
  }
  object.notes = std::move(file.notes);
  RepairedMesh repaired = NamingMesh(path_or_name, [&] { return RepairMesh(file.mesh); });
  object.mesh = std::move(repaired.mesh);
  object.mesh.vertices *= scale;
  RequireInRange(object.mesh, path_or_name);
  for (std::string& action : repaired.actions) object.notes.push_back(std::move(action));
  const MeshReport report = NamingMesh(path_or_name, [&] { return CheckMesh(object.mesh); });
  object.implausible_size = report.implausible_size;
  object.suggested_scale = report.suggested_scale;
  if (report.implausible_size) {
    object.notes.push_back(fmt::format(
        "The object is {:.3g} x {:.3g} x {:.3g} m: is it in metres?{}", report.extent_m.x(),
        report.extent_m.y(), report.extent_m.z(),
        report.suggested_scale != 1.0
            ? fmt::format(" (--object-scale {:g} would make it handheld)", report.suggested_scale)
            : ""));
  }
  if (!report.watertight) {
    object.notes.push_back(
        "The mesh is not watertight: inside and outside are judged by winding numbers");
  }
  return object;
}

void RequireHandheld(const LoadedObject& object) {
  if (!object.implausible_size) return;
  const Eigen::Vector3d extent = Extent(object.mesh);
  const Eigen::Vector3d in_cm = 100.0 * object.suggested_scale * extent;
  throw Error(object.source,
              fmt::format("is {:.3g} x {:.3g} x {:.3g} m, no size to hold", extent.x(), extent.y(),
                          extent.z()),
              object.suggested_scale != 1.0
                  ? fmt::format("Meshes are in metres, this one is likely in {}: --object-scale "
                                "{:g} makes it {:.3g} x {:.3g} x {:.3g} cm",
                                UnitOfScale(object.suggested_scale), object.suggested_scale,
                                in_cm.x(), in_cm.y(), in_cm.z())
                  : "Meshes are in metres: give its unit with --object-scale");
}

TriangleMesh ForFitting(const LoadedObject& object, int vertices, std::vector<std::string>* notes) {
  if (object.mesh.NumVertices() <= vertices) return object.mesh;
  DecimateOptions options;
  options.vertices = vertices;
  options.samples = 0;
  DecimateResult result = NamingMesh(object.source, [&] { return Decimate(object.mesh, options); });
  if (notes != nullptr) {
    for (std::string& note : result.notes) notes->push_back(std::move(note));
  }
  return std::move(result.mesh);
}

void RequireNew(const fs::path& path, const CommonOptions& options) {
  RequireNewFolder(path, options);
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, a file is to be written", "Choose a file name");
  }
}

void RequireNewFolder(const fs::path& path, const CommonOptions& options) {
  if (path.empty()) throw Error("--output", "is an empty name", "Name what is to be written");
  std::error_code error;
  if (!options.force && fs::exists(path, error)) {
    throw Error(path.string(), "exists already", "Choose another name, or give --force");
  }
  fs::path above = fs::absolute(path, error).parent_path();
  while (!fs::exists(above, error) && above.has_relative_path()) above = above.parent_path();
  const bool folder = fs::is_directory(above, error);
  if (folder && ::access(above.c_str(), W_OK | X_OK) == 0) return;
  throw Error(path.string(),
              fmt::format("cannot be written: '{}' is {}", above.string(),
                          folder ? "read-only" : "not a folder"),
              "Choose another place");
}

nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options) {
  return {{"schema", schema}, {"holdfast_version", HOLDFAST_VERSION}, {"seed", options.seed}};
}

void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text) {
  if (options.json) {
    fmt::print("{}\n", summary.dump(2));
  } else {
    fmt::print("{}", text);
  }
  std::fflush(stdout);
}

}  // namespace holdfast::apps
