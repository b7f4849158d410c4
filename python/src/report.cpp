// SPDX-License-Identifier: MIT
#include "geometry/report/report_page.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "python/src/fit.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

struct NamedClip {
  std::string name;
  py::object clip;
  bool told = false;  // name given by the user
};

std::vector<NamedClip> ClipsOf(const py::object& clips) {
  std::vector<NamedClip> named;
  if (py::isinstance<py::dict>(clips)) {
    for (const auto& [name, clip] : clips.cast<py::dict>()) {
      named.push_back({py::str(name), py::reinterpret_borrow<py::object>(clip), true});
    }
  } else if (py::isinstance<py::list>(clips) || py::isinstance<py::tuple>(clips)) {
    for (const py::handle clip : clips) {
      named.push_back(
          {fmt::format("clip {}", named.size() + 1), py::reinterpret_borrow<py::object>(clip)});
    }
  } else {
    named.push_back({"clip", clips});
  }
  if (named.empty()) throw py::value_error("clips: expected one clip or more, got none");
  return named;
}

ReportInput InputOf(const NamedClip& named, const py::object& object, double object_scale,
                    const py::object& body) {
  ReportInput input = SceneOf(named.clip, object, object_scale, body, named.name.c_str());
  const py::object fit = py::hasattr(named.clip, "fit") ? named.clip.attr("fit") : named.clip;
  if (py::isinstance<CarriedClip>(fit)) {
    const CarryReport& report = fit.cast<const CarriedClip&>().run.report;
    input.metrics = {{"per_frame", FitFramesJson(report.fit, report.contact, report.clearance)},
                     {"summary", FitSummaryJson(report.fit, report.contact)}};
  } else if (!input.file.empty()) {
    input.metrics = MetricsBeside(input.file);
    const std::filesystem::path table = MeshBeside(input.file, input.clip.table);
    if (!table.empty()) input.table = ReadMesh(table);
  }
  if (named.told) {
    input.source = named.name;
    input.file.clear();
  }
  return input;
}

void Report(const py::object& clips, const std::filesystem::path& path, const py::object& object,
            double object_scale, const py::object& body, double contact_threshold_mm,
            const std::string& title, bool force, int threads, const py::object& progress) {
  ReportPageOptions options;
  options.title = title;
  options.contact_threshold_mm = contact_threshold_mm;
  options.threads = ThreadsOf(threads);
  RequireBetween(contact_threshold_mm, "contact_threshold_mm", 0.1, 12.0);
  RequirePositive(object_scale, "object_scale");
  ModelOf(body);
  RequireNew(path, force);
  std::vector<ReportInput> inputs;
  for (const NamedClip& named : ClipsOf(clips)) {
    inputs.push_back(InputOf(named, object, object_scale, body));
  }
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    const ReportPage page = MakeReportPage(inputs, options, go_on);
    if (!page.html.empty()) WriteAtomically(path, page.html);
  });
}

}  // namespace

void BindReport(py::module_& module) {
  const ReportPageOptions usual;
  module.def(
      "report", &Report, "clips"_a, "path"_a, py::kw_only(), "object"_a = py::none(),
      "object_scale"_a = 1.0, "body"_a = py::none(),
      "contact_threshold_mm"_a = usual.contact_threshold_mm, "title"_a = "", "force"_a = false,
      "threads"_a = 0, "progress"_a = py::none(),
      "Writes one self-contained page (.html) of a clip: a 3D player, curves of every frame, "
      "provenance. It needs no network.\n"
      "\n"
      "clips: a Clip, a result of fit(), refine(), grasp() or synthesize(), a file, a result "
      "folder or an embedded name; or a list of them, or a dict of them by the names to show. A "
      "second clip is overlaid on the first as a ghost; with more clips, the page has a selection. "
      "object, object_scale, body as in score(), for all clips; a result brings its own object and "
      "the curves of its energies. contact_threshold_mm: skin this close to the object counts as "
      "contact, 0.1 to 12, where the clip has no metrics. title: of the page; default: the names "
      "of object and motion. force: overwrite an existing file. Raises Error if the file exists, "
      "and if the library was built without the player; Stopped.\n"
      "\n"
      "    holdfast.report({'mug': held, 'bottle': held_bottle}, 'compare.html')");
}

}  // namespace holdfast::python
