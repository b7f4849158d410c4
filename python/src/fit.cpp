// SPDX-License-Identifier: MIT
#include "python/src/fit.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numbers>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "python/src/custom_term.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/fit_options.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// Runs fit() with the options given by name.
CarriedPtr Fit(const py::object& clip, const py::object& object, const py::object& at,
               const py::object& region, const py::object& avoid, const py::object& avoid_balls,
               const py::object& weights, const py::object& custom_terms, const py::object& body,
               std::uint64_t seed, int threads, const py::object& progress,
               const py::kwargs& given) {
  FitJob job;
  CarryOptions& carry = job.carry;
  SetOptions(given, OptionsOf(job));
  if (!carry.hand_over && !carry.handover.switch_frames.empty()) {
    throw py::value_error("switch_frames: needs hand_over=True");
  }
  SetWeights(weights, carry.fit);
  carry.fit.custom_terms = CustomTermsOf(custom_terms);
  carry.place = PlaceOf(at, region, avoid, avoid_balls, carry.object_scale);
  if (job.keep_grasp && (job.regrasp || carry.place)) {
    throw py::value_error(
        "keep_grasp: not together with regrasp, at, region, avoid or avoid_balls");
  }
  carry.seed = seed;
  carry.threads = ThreadsOf(threads);
  ModelOf(body);
  const ClipArgument motion = ClipOf(clip, body);
  const LoadedObject loaded = ObjectOf(object, motion, carry.object_scale);
  job.clip = motion.name;
  job.object = loaded.name;
  const auto prepared = PrepareAside(loaded, job.object_vertices, carry.threads);

  CarriedPtr carried;
  std::vector<std::string> notes;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    carried = Carry(job, LoadedOf(motion), false, prepared, go_on, notes);
  });
  LogNotes(notes);
  return carried;
}

constexpr const char* kFitDoc =
    R"(Fits an object to a clip: solves object pose and finger angles for every frame.

If the clip has an object trajectory, the fit uses it as data. Otherwise a hand takes the object in
the first frame and holds it.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
object : str, path or (vertices, faces), optional
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3). Default:
    the mesh of the clip's own object (clip.object.surface, or the mesh that its track references).
at : array_like (3,), optional
    Point where the object is grasped, in the object's frame, meters, scaled.
region : path or (vertices, faces), optional
    Part of the object's surface to touch, scaled as the object is.
avoid : path or (vertices, faces), optional
    Part of the object's surface not to touch, scaled as the object is.
avoid_balls : array_like (N, 4), optional
    Centers and radii of balls that the hand stays out of, in the object's frame, meters, scaled.
weights : dict, optional
    Weights by term, such as {'penetration': 3000.0}.
custom_terms : list of CustomTerm, optional
    Additional terms. Needs solve='sequential'.
body : BodyModel, optional
    In place of the embedded model.
seed : int, default 1
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
FitResult

Raises
------
FitFailure
    If no hand can hold the object or touches it.
Stopped
    If progress returns False.
Error
    For invalid input.

Examples
--------
>>> held = holdfast.fit('demo_drink', 'mug')
>>> held.clip.save('held.npz')
)";

constexpr const char* kOffhandDoc =
    R"(Fits an object to a motion in which it passes from hand to hand: fit() with hand_over=True.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
object : str, path or (vertices, faces), optional
    As in fit().
**kwargs
    Arguments of fit() by name, except hand_over.

Returns
-------
FitResult
)";

// One number per frame.
template <typename Number, typename Frame, typename Get>
py::array_t<Number> PerFrame(const std::vector<Frame>& frames, const Get& get) {
  py::array_t<Number> array(static_cast<py::ssize_t>(frames.size()));
  std::transform(frames.begin(), frames.end(), array.mutable_data(), get);
  return array;
}

py::dict EnergiesOf(const CarriedClip& self) {
  using F = FrameReport;
  const std::vector<F>& frames = self.run.report.fit.frames;
  py::dict energies("energy_total"_a =
                        PerFrame<double>(frames, [](const F& f) { return f.energy_total; }));
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric == nullptr) continue;
    energies[info.metric] =
        PerFrame<double>(frames, [&](const F& f) { return f.energies[info.term]; });
  }
  for (std::size_t k = 0; k < self.run.report.fit.custom_terms.size(); ++k) {
    energies[py::str("energy_" + self.run.report.fit.custom_terms[k])] =
        PerFrame<double>(frames, [&](const F& f) { return f.custom_energies.at(k); });
  }
  return energies;
}

// Converts each list to an array of its type.
py::dict PerFrameDict(const CarriedClip& self) {
  const nlohmann::json columns =
      FitFramesJson(self.run.report.fit, self.run.report.contact, self.run.report.clearance);
  const py::object as_array = py::module_::import("numpy").attr("asarray");
  py::dict arrays;
  for (const auto& [name, column] : columns.items()) {
    const py::object list = ToPython(column);
    arrays[py::str(name)] = name == "stop" ? list : as_array(list);
  }
  return arrays;
}

py::dict FirstGraspOf(const CarriedClip& self) {
  const FirstGrasp& first = self.run.report.grasp;
  py::dict grasp("made"_a = first.made);
  if (!first.made) return grasp;
  grasp["status"] = first.status;
  grasp["search_ms"] = first.search_ms;
  if (first.one) {
    grasp.attr("update")(GraspDict(*first.one));
    grasp["frames_through_body_ratio"] = first.through_body;
  }
  for (int h = 0; first.both && h < 2; ++h) {
    grasp[h == 0 ? "right" : "left"] = GraspDict(first.both->hands[h]);
  }
  return grasp;
}

nlohmann::json SwitchesOfFit(const CarriedClip& self) {
  return SwitchesJson(self.run.report.holding, self.run.report.handovers);
}

const char* HolderOf(const CarriedClip& self) {
  return self.run.report.held_by == kHoldsRight  ? "right"
         : self.run.report.held_by == kHoldsLeft ? "left"
                                                 : "both";
}

void BindFitResult(py::module_& module) {
  py::class_<CarriedClip, CarriedPtr>(module, "FitResult",
                                      "The result of a fit: a clip with its object, and measures.")
      .def_readonly("clip", &CarriedClip::clip,
                    "Clip with object, fitted fingers and arms, and holding_hand")
      .def_property_readonly(
          "status", [](const CarriedClip&) { return "carried"; },
          "'carried'; any other outcome raises FitFailure")
      .def_property_readonly("held_by", &HolderOf,
                             "'right' or 'left' if only that hand holds the object, else 'both'; "
                             "clip.holding_hand has the holding hand of each frame")
      .def_property_readonly(
          "warnings",
          [](const CarriedClip& self) {
            std::vector<std::string> warnings;
            for (const std::string& text : self.run.warnings) warnings.push_back(PythonText(text));
            return warnings;
          },
          "list of str: warnings")
      .def_property_readonly(
          "metrics",
          [](const CarriedClip& self) { return ToPython(FitMetricsJson(self.job, self.run)); },
          "dict: the content of the program's metrics.json: options, contact, energies, solver")
      .def_property_readonly("energies", &EnergiesOf,
                             "dict of (T,) arrays by term and unit ('energy_penetration_m2'), "
                             "without weights; 'energy_total' is the weighted sum")
      .def_property_readonly("per_frame", &PerFrameDict,
                             "dict of (T,) arrays: energies, contact, penetration, solver; 'stop' "
                             "is a list of str")
      .def_property_readonly(
          "contact",
          [](const CarriedClip& self) {
            return ToPython(FitSummaryJson(self.run.report.fit, self.run.report.contact));
          },
          "dict of numbers: contact and penetration over the clip, frames, contact pairs, frames "
          "that failed, medians of the solve")
      .def_property_readonly("grasp", &FirstGraspOf,
                             "dict: 'made', and for a new grasp its measures, 'fingers' (45,) and "
                             "'wrist_from_object' (4, 4); for both hands by 'right' and 'left'")
      .def_property_readonly(
          "drink",
          [](const CarriedClip& self) {
            return ToPython(
                DrinkJson(self.run.report.drink, self.run.report.drunk.value_or(DrinkMeasures{})));
          },
          "dict: measures of drinking (fit(drink=True)), in frames, millimeters, degrees; or None")
      .def_property_readonly(
          "clearance",
          [](const CarriedClip& self) {
            return ToPython(ClearanceJson(self.run.report.clearance));
          },
          "dict of numbers: by how much the arms were adjusted to avoid the body, and frames that "
          "still collide")
      .def_property_readonly(
          "switches", [](const CarriedClip& self) { return ToPython(SwitchesOfFit(self)); },
          "list of dict: hand-overs, with frame, from, to, confidence")
      .def_property_readonly(
          "seconds", [](const CarriedClip& self) { return self.run.seconds; },
          "time to grasp, fit and measure, without preparing the object")
      .def_property_readonly(
          "object", [](const CarriedClip& self) { return MeshTuple(self.run.object->object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)) that was fitted, scaled; copies")
      .def_property_readonly(
          "object_name", [](const CarriedClip& self) { return self.run.object->object.name; },
          "str: name of the object")
      .def("__repr__", [](const CarriedClip& self) {
        return fmt::format("<holdfast.FitResult: {} held by {}>", self.run.object->object.name,
                           HoldersText(CountHeld(self.clip->holding_hand)));
      });
}

}  // namespace

std::shared_ptr<const PreparedObject> PrepareAside(const LoadedObject& object, int vertices,
                                                   int threads) {
  return RunAside([object, vertices, threads] {
    return std::make_shared<const PreparedObject>(PrepareObject(object, vertices, threads));
  });
}

CarriedPtr Carry(const FitJob& job, LoadedClip motion, bool made,
                 std::shared_ptr<const PreparedObject> object, const StagedProgress& progress,
                 std::vector<std::string>& notes) {
  FitInput input;
  input.motion = std::move(motion);
  input.made = made;
  input.object = std::shared_ptr<const LoadedObject>(object, &object->object);
  input.prepare = [&object] { return std::move(object); };
  auto carried = std::make_shared<CarriedClip>();
  carried->job = job;
  carried->run = RunFit(
      job, std::move(input), [](const std::string&) {}, progress);
  FitRun& run = carried->run;
  if (run.report.status == CarryStatus::kStopped) throw Stopped();
  notes.insert(notes.end(), run.notes.begin(), run.notes.end());
  carried->clip = WithSurface(run.report.clip, run.object->object.mesh);
  return carried;
}

void BindFit(py::module_& module) {
  BindCustomTerm(module);
  BindFitResult(module);
  FitJob job;
  module.def("fit", &Fit, "clip"_a, "object"_a = py::none(), py::kw_only(), "at"_a = py::none(),
             "region"_a = py::none(), "avoid"_a = py::none(), "avoid_balls"_a = py::none(),
             "weights"_a = py::none(), "custom_terms"_a = py::none(), "body"_a = py::none(),
             "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kFitDoc, OptionsOf(job)).c_str());
  module.def(
      "offhand",
      [fit = py::object(module.attr("fit"))](const py::object& clip, const py::object& object,
                                             const py::kwargs& options) {
        if (options.contains("hand_over")) {
          throw py::type_error("offhand: hand_over is always True; use fit() to fit without it");
        }
        return fit(clip, object, "hand_over"_a = true, **options);
      },
      "clip"_a, "object"_a = py::none(), kOffhandDoc);
  BindRefine(module);
  BindTransfer(module);
  BindGrasp(module);
  BindFrameFitter(module);
}

using namespace py::literals;

ModelPtr ModelOf(const py::object& body, const char* name) {
  if (body.is_none()) return BodyModel::Default();
  if (!py::isinstance<BodyModel>(body)) {
    throw py::type_error(std::string(name) + ": expected a BodyModel or None, got " +
                         TypeText(body));
  }
  return body.cast<ModelPtr>();
}

std::optional<GraspPlace::Wanted> PlaceOf(const py::object& at, const py::object& region,
                                          const py::object& avoid, const py::object& avoid_balls,
                                          double scale) {
  if (at.is_none() && region.is_none() && avoid.is_none() && avoid_balls.is_none()) {
    return std::nullopt;
  }
  GraspPlace::Wanted wanted;
  for (TriangleMesh* part : {&wanted.region, &wanted.avoid}) {
    part->vertices.resize(3, 0);
    part->faces.resize(3, 0);
  }
  if (!region.is_none()) wanted.region = MeshArgument(region, "region", scale);
  if (!avoid.is_none()) wanted.avoid = MeshArgument(avoid, "avoid", scale);
  if (!avoid_balls.is_none()) {
    const auto balls = Floats(avoid_balls, "avoid_balls", {-1, 4});
    for (py::ssize_t k = 0; k < balls.shape(0); ++k) {
      const double radius = *balls.data(k, 3);
      RequireBetween(radius, "avoid_balls: radius", 0.0, 1e3);
      wanted.avoid_balls.push_back({Eigen::Map<const Eigen::Vector3d>(balls.data(k, 0)), radius});
    }
  }
  if (!at.is_none()) wanted.at = Eigen::Map<const Eigen::Vector3d>(Floats(at, "at", {3}).data());
  return wanted;
}

void SetWeights(const py::object& weights, FitOptions& options) {
  if (weights.is_none()) return;
  if (!py::isinstance<py::dict>(weights)) {
    throw py::type_error("weights: expected a dict such as {'penetration': 3000.0}, got " +
                         TypeText(weights));
  }
  OptionTable table;
  AddWeightOptions(table, options, [](const EnergyTermInfo&) { return true; });
  for (const auto& [key, value] : weights.cast<py::dict>()) {
    const std::string name = py::str(key);
    if (table.Find("lambda_" + name) == nullptr) {
      std::string known;
      for (const EnergyTermInfo& info : EnergyTerms()) {
        known += fmt::format("{}'{}'", known.empty() ? "" : ", ", info.name);
      }
      throw py::value_error(
          fmt::format("weights: no term is called '{}'. There are: {}", name, known));
    }
    py::kwargs one;
    one[py::str("lambda_" + name)] = value;
    SetOptions(one, table);
  }
}

py::dict GraspDict(const Grasp& grasp) {
  const Eigen::Matrix4d wrist_from_object = grasp.wrist_from_object.matrix();
  py::dict dict = ToPython(GraspJson(grasp));
  dict["contacts_outside_place_ratio"] = grasp.outside_place;
  dict["from_point_mm"] = 1e3 * grasp.from_place_m;
  dict["fingers"] = py::array_t<double>(grasp.fingers.size(), grasp.fingers.data());
  dict["wrist_from_object"] = Rows(wrist_from_object.transpose());
  return dict;
}

nlohmann::json EnergiesJson(const FrameReport& frame) {
  nlohmann::json energies = {{"energy_total", frame.energy_total}};
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric != nullptr) energies[info.metric] = frame.energies[info.term];
  }
  return energies;
}

}  // namespace holdfast::python
