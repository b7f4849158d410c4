// SPDX-License-Identifier: MIT
#include "solver/carry/refine.h"

#include <utility>

#include <pybind11/stl.h>

#include "geometry/error.h"
#include "geometry/mesh/surface_distance.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

struct RefinedClip {
  ClipPtr clip;
  RefineReport report;  // without its clip
  LoadedObject object;
};
using RefinedPtr = std::shared_ptr<RefinedClip>;

// Object of the clip's trajectory. `given` has to be the same object.
LoadedObject RefinedObject(const ClipArgument& clip, const py::object& given, double scale) {
  LoadedObject object = ObjectOf(given, clip, scale);
  if (given.is_none()) return object;
  const ClipObject own = OwnObject(clip);
  if (own.mesh && !own.by_name && !SameSurface(*own.mesh, object.mesh)) {
    throw Error(object.source,
                "is not the object of the clip's trajectory: " + clip.clip->object->mesh,
                "Leave out object, or fit it again: fit(clip, object)");
  }
  return object;
}

RefinedPtr Refine(const py::object& clip, const py::object& object, const py::object& weights,
                  double object_scale, const py::object& body, int threads,
                  const py::object& progress, const py::kwargs& given) {
  RefineOptions options;
  SetOptions(given, OptionsOf(options));
  SetWeights(weights, options.fit);
  RequirePositive(object_scale, "object_scale");
  options.threads = ThreadsOf(threads);
  ModelOf(body);
  const ClipArgument input = ClipOf(clip, body);
  if (!input.clip->object) {
    throw Error(input.name, "has no object trajectory to refine",
                "Make one with fit(), or give a clip with an object");
  }
  auto refined = std::make_shared<RefinedClip>();
  refined->object = RefinedObject(input, object, object_scale);
  const auto prepared = PrepareAside(refined->object, options.object_vertices, options.threads);
  LogNotes(prepared->notes);
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    refined->report = NamingSource("the clip", input.name, [&] {
      return RefineCarried(*input.clip, input.body, *prepared, options, go_on);
    });
  });
  if (refined->report.status == RefineStatus::kStopped) throw Stopped();
  RequireRefined(refined->report, input.name, refined->object.name);
  refined->clip = WithSurface(std::move(refined->report.result.clip), refined->object.mesh);
  return refined;
}

nlohmann::json QualityJson(const CarriedQuality& quality) {
  nlohmann::json json = ContactJson(quality.contact);
  json.update(HandsJson(quality));
  const Unevenness& object = quality.jitter.object;
  for (const auto& [name, value] :
       {std::pair<const char*, std::optional<double>>("object_acceleration_m_s2",
                                                      object.acceleration_m_s2),
        {"object_jerk_m_s3", object.jerk_m_s3},
        {"object_angular_acceleration_rad_s2", object.angular_acceleration_rad_s2},
        {"object_acceleration_against_hand", quality.jitter.acceleration_ratio}}) {
    json[name] = value ? nlohmann::json(*value) : nlohmann::json();
  }
  return json;
}

nlohmann::json HoldsOfRefined(const RefinedClip& self) {
  return HoldsJson(self.report.result)["holds"];
}

nlohmann::json RestsOfRefined(const RefinedClip& self) {
  return HoldsJson(self.report.result)["rests"];
}

nlohmann::json TouchesOfRefined(const RefinedClip& self) {
  return HoldsJson(self.report.result)["touches"];
}

// Minimum distance between skin and object in each frame.
py::array_t<double> LeastDistances(const ContactScore& contact) {
  py::array_t<double> distances(static_cast<py::ssize_t>(contact.frames.size()));
  double* out = distances.mutable_data();
  for (const ContactScore::Frame& frame : contact.frames) *out++ = frame.min_distance_mm;
  return distances;
}

py::dict DistanceDict(const RefinedClip& self) {
  const DataDistance& distance = self.report.distance;
  const auto array = [](const std::vector<double>& values) {
    return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  return py::dict("rms_mm"_a = distance.rms_mm, "rms_deg"_a = distance.rms_degrees,
                  "mm"_a = array(distance.mm), "deg"_a = array(distance.degrees));
}

constexpr const char* kRefineDoc =
    R"(Refines a clip that has its object's trajectory, captured or predicted.

Reduces penetration, jitter and lost contact, and stays close to the data.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
object : str, path or (vertices, faces), optional
    As in fit().
weights : dict, optional
    Weights by term, as in fit().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
RefineResult

Raises
------
FitFailure
    If no holding hand touches the object.
Stopped
    If progress returns False.
Error
    For invalid input.
)";

}  // namespace

void BindRefine(py::module_& module) {
  py::class_<RefinedClip, RefinedPtr>(module, "RefineResult",
                                      "A refined clip, with measures before and after.")
      .def_readonly("clip", &RefinedClip::clip,
                    "Clip with refined object, arms and fingers, and holding_hand")
      .def_property_readonly(
          "before",
          [](const RefinedClip& self) { return ToPython(QualityJson(self.report.before)); },
          "dict of numbers: contact, penetration, jitter of the object")
      .def_property_readonly(
          "after", [](const RefinedClip& self) { return ToPython(QualityJson(self.report.after)); },
          "dict of numbers: the same for the refined clip, for the same hands in the same frames")
      .def_property_readonly(
          "gaps",
          [](const RefinedClip& self) {
            return py::make_tuple(LeastDistances(self.report.before.contact),
                                  LeastDistances(self.report.after.contact));
          },
          "(before (T,), after (T,)): minimum distance of the hands' skin from the object, mm")
      .def_property_readonly("distance", &DistanceDict,
                             "dict: distance of the object from the data, 'rms_mm', 'rms_deg', and "
                             "per frame 'mm' and 'deg' (T,)")
      .def_property_readonly(
          "holds", [](const RefinedClip& self) { return ToPython(HoldsOfRefined(self)); },
          "list of dict: frames [begin, end) that a hand holds, and how")
      .def_property_readonly(
          "rests", [](const RefinedClip& self) { return ToPython(RestsOfRefined(self)); },
          "list of dict: frames [begin, end) in which the object lies still")
      .def_property_readonly(
          "touches", [](const RefinedClip& self) { return ToPython(TouchesOfRefined(self)); },
          "list of dict: frames [begin, end) in which a hand touches the object without moving it")
      .def_property_readonly(
          "kept", [](const RefinedClip& self) { return ToPython(KeptJson(self.report.kept)); },
          "list of dict: frames [begin, end) left unchanged, because refining made the penetration "
          "deeper")
      .def_property_readonly(
          "clearance",
          [](const RefinedClip& self) { return ToPython(ClearanceJson(self.report.clearance)); },
          "dict: how arms and object were moved out of the person's own body, and what remains")
      .def_property_readonly(
          "fingers",
          [](const RefinedClip& self) { return ToPython(FingersJson(self.report.fingers)); },
          "list of dict: for each hand, whether fingers move, frames in which a joint jumped by "
          "more than 40 degrees, rotations replaced")
      .def_property_readonly(
          "ball", [](const RefinedClip& self) { return self.report.ball; },
          "whether the object is a ball without recorded rotation")
      .def_property_readonly(
          "solve",
          [](const RefinedClip& self) {
            const ClipReport& solve = self.report.result.report;
            return py::dict("iterations"_a = solve.iterations, "converged"_a = solve.converged,
                            "cost_before"_a = solve.cost_before, "cost_after"_a = solve.cost_after,
                            "solve_ms"_a = solve.solve_ms);
          },
          "dict: iterations, converged, cost_before, cost_after, solve_ms")
      .def_property_readonly(
          "object", [](const RefinedClip& self) { return MeshTuple(self.object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)), scaled; copies")
      .def("__repr__", [](const RefinedClip& self) {
        return fmt::format("<holdfast.RefineResult: {} frames>", self.clip->NumFrames());
      });
  RefineOptions options;
  module.def("refine", &Refine, "clip"_a, "object"_a = py::none(), py::kw_only(),
             "weights"_a = py::none(), "object_scale"_a = 1.0, "body"_a = py::none(),
             "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kRefineDoc, OptionsOf(options)).c_str());
}

}  // namespace holdfast::python
