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
  }
  if (named.told) {
    input.source = named.name;
    input.file.clear();
  }
  return input;
}

void Report(const py::object& clips, const std::filesystem::path& path, const py::object& object,
            double object_scale, const py::object& body, bool force, int threads,
            const py::object& progress, const py::kwargs& given) {
  ReportPageOptions options;
  SetOptions(given, OptionsOf(options));
  options.threads = ThreadsOf(threads);
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

constexpr const char* kReportDoc =
    R"(Writes one self-contained page (.html) of a clip, with a 3D player.

It also has curves of every frame and provenance. It needs no network.

Parameters
----------
clips : Clip, result, str or path; or list or dict of them
    Clip, result of fit(), refine(), grasp() or synthesize(), file, result folder, or name of an
    embedded clip; or a list of them, or a dict of them by the names to show. A second clip is
    overlaid on the first as a ghost. With more clips, the page has a selection. A result brings its
    own object and the curves of its energies.
path : path
object : str, path or (vertices, faces), optional
    Mesh in meters in place of the clips', as in score().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
force : bool, default False
    Overwrite an existing file.
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Raises
------
Error
    If the file exists, unless force=True, and if the library was built without the player.
Stopped
    If progress returns False.

Examples
--------
>>> holdfast.report({'mug': held, 'bottle': held_bottle}, 'compare.html')
)";

}  // namespace

void BindReport(py::module_& module) {
  ReportPageOptions usual;
  module.def("report", &Report, "clips"_a, "path"_a, py::kw_only(), "object"_a = py::none(),
             "object_scale"_a = 1.0, "body"_a = py::none(), "force"_a = false, "threads"_a = 0,
             "progress"_a = py::none(), WithOptions(kReportDoc, OptionsOf(usual)).c_str());
}

}  // namespace holdfast::python
