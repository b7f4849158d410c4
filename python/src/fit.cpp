// SPDX-License-Identifier: MIT
#include "python/src/fit.h"
#include "python/src/custom_term.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numbers>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/import/held_distance.h"
#include "geometry/io/mesh/mesh_io.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"
#include "solver/fit/energy.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

constexpr int kFitVertices = 300;  // of the object, for the terms of pairs

// A new grasp, or the clip's own? Objects that no hand can hold are refused here, before anything
// is prepared for them.
void ChooseGrasp(FitCall& call, std::vector<std::string>& notes) {
  CarryOptions& options = call.options;
  const Clip& clip = *call.clip.clip;
  const bool needed = NeedsGrasp(clip, call.object, options);
  if (const std::string why = WhyNewGrasp(clip, call.object, call.object.name, options);
      !why.empty()) {
    notes.push_back(why + ": a new one is made (keep_grasp=True keeps it)");
  }
  options.grasp = needed ? GraspSource::kNew : GraspSource::kClips;
  if (!needed) return;
  const bool both = options.hands == CarryHands::kBoth ||
                    std::ranges::count(clip.holding_hand, kHoldsRight | kHoldsLeft) > 0;
  if (const std::optional<std::string> why = WhyTooLarge(call.object, both)) throw Failure(*why);
}

void RequireCarried(const CarryReport& report, const FitCall& call) {
  if (report.status == CarryStatus::kStopped) throw Stopped();
  const std::string& object = call.object.name;
  if (report.status == CarryStatus::kNoGrasp) {
    const bool left = report.holding.hands.front() == kHoldsLeft;
    const std::string other = report.grasp.both ? "a first frame with both hands in front"
                                                : fmt::format("--hand {}", left ? "right" : "left");
    throw Failure(fmt::format("{}: {}. Try {}, {}", object, report.grasp.status, other,
                              call.options.place ? "or another place (--at, --region, --avoid)"
                                                 : "or another object size (--object-scale)"));
  }
  if (report.status == CarryStatus::kNoContact) {
    throw Failure(fmt::format(
        "{}: {} touches no hand in any frame. {}", call.clip.name, object,
        report.grasp.made
            ? "Try another --hand, or another frame to take hold in"
            : "Its trajectory is of another object, scale or body: --regrasp makes a new grasp"));
  }
}

struct HandOverArguments {
  bool hand_over;
  const std::string& first_hand;
  const py::object& switch_frames;
  int max_switches;
  double dwell_s;
};

void SetHandOver(const HandOverArguments& in, CarryOptions& options) {
  options.hand_over = in.hand_over;
  options.handover.first_hand = Choice<std::optional<Side>>(
      in.first_hand, "first_hand",
      {{"auto", std::nullopt}, {"right", Side::kRight}, {"left", Side::kLeft}});
  RequireBetween(in.max_switches, "max_switches", 1, 100);
  RequireBetween(in.dwell_s, "dwell_s", 0.0, 10.0);
  options.handover.max_switches = in.max_switches;
  options.handover.dwell_s = in.dwell_s;
  if (in.switch_frames.is_none()) return;
  if (!in.hand_over) throw py::value_error("switch_frames: needs hand_over=True");
  const py::array_t<int> frames = Integers(in.switch_frames, "switch_frames", {-1});
  options.handover.switch_frames.assign(frames.data(), frames.data() + frames.size());
}

void SetSolver(const std::string& recipe, const std::string& solve, const std::string& precision,
               double contact_threshold_mm, int max_iterations, CarryOptions& options) {
  options.recipe = Choice<FitRecipe>(recipe, "recipe",
                                     {{"holdfast", FitRecipe::kHoldfast},
                                      {"paper", FitRecipe::kPaper},
                                      {"imos-code", FitRecipe::kImosCode}});
  options.fit.whole_clip = Choice<bool>(solve, "solve", {{"sequential", false}, {"batch", true}});
  options.fit.precision = Choice<PairPrecision>(
      precision, "precision",
      {{"single", PairPrecision::kSingle}, {"double", PairPrecision::kDouble}});
  RequirePositive(contact_threshold_mm, "contact_threshold_mm");
  RequireBetween(max_iterations, "max_iterations", 1, 10'000);
  options.fit.contact_threshold_m = 1e-3 * contact_threshold_mm;
  options.fit.max_iterations = max_iterations;
}

CarriedPtr Fit(const py::object& clip, const py::object& object, const std::string& hand,
               const std::string& style, const std::string& use, const py::object& at,
               const py::object& region, const py::object& avoid, bool regrasp, bool keep_grasp,
               bool keep_motion, bool drink, const std::string& recipe, const std::string& solve,
               const py::object& weights, double contact_threshold_mm, bool slip, bool hand_over,
               const std::string& first_hand, const py::object& switch_frames, int max_switches,
               double dwell_s, double object_scale, int object_vertices, int max_iterations,
               const std::string& precision, const std::string& normalize,
               const py::object& custom_terms, const py::object& body, std::uint64_t seed,
               int threads, const py::object& progress) {
  FitCall call;
  CarryOptions& options = call.options;
  options.hands = Choice<CarryHands>(hand, "hand",
                                     {{"auto", CarryHands::kAuto},
                                      {"right", CarryHands::kRight},
                                      {"left", CarryHands::kLeft},
                                      {"both", CarryHands::kBoth}});
  options.style = StyleOf(style);
  options.use = UseOf(use);
  SetHandOver({hand_over, first_hand, switch_frames, max_switches, dwell_s}, options);
  SetSolver(recipe, solve, precision, contact_threshold_mm, max_iterations, options);
  SetWeights(weights, options.fit);
  options.fit.custom_terms = CustomTermsOf(custom_terms);
  options.fit.normalize = Choice<Normalization>(
      normalize, "normalize", {{"sum", Normalization::kSum}, {"mean", Normalization::kMean}});
  options.fit.slip = slip;
  options.keep_motion = keep_motion;
  options.drink = drink;
  RequirePositive(object_scale, "object_scale");
  RequireBetween(object_vertices, "object_vertices", 4, 100'000);
  options.object_scale = object_scale;
  options.place = PlaceOf(at, region, avoid, object_scale);
  if (keep_grasp && (regrasp || options.place)) {
    throw py::value_error("keep_grasp: not together with regrasp, at, region or avoid");
  }
  options.grasp = keep_grasp                 ? GraspSource::kClips
                  : regrasp || options.place ? GraspSource::kNew
                                             : GraspSource::kClipsOrNew;
  options.seed = seed;
  options.threads = ThreadsOf(threads);
  ModelOf(body);
  call.clip = ClipOf(clip, body);
  call.object = ObjectOf(object, call.clip, object_scale);
  options.other_body = call.clip.other_body;
  if (options.grasp == GraspSource::kClipsOrNew) {
    if (ClipObject own = OwnObject(call.clip); !own.by_name) {
      options.clip_object = std::move(own.mesh);
    }
  }

  CarriedPtr carried;
  std::vector<std::string> notes;
  {
    const py::gil_scoped_release unlocked;
    ChooseGrasp(call, notes);
  }
  call.prepared = PrepareAside(call.object, object_vertices, options.threads);
  RunWithProgress(progress,
                  [&](const StagedProgress& go_on) { carried = RunFit(call, go_on, notes); });
  LogNotes(notes);
  return carried;
}

constexpr const char* kFitDoc = R"(Carries an object through a clip: object pose and finger angles
are solved for every frame. A clip that has the object's trajectory keeps it as data; without one a
hand takes the object in the first frame and holds it.

clip: Clip, path, or name of an embedded clip. object: path, name of an embedded object, or
(vertices (V, 3), faces (F, 3)) in metres; None: the mesh of the clip's own object
(clip.object.surface, or what its track names).

hand: 'auto' (as the clip says, else the right), 'right', 'left', 'both'. style of a new grasp:
'auto', 'power', 'precision', 'handle'. use: what the object is taken for: 'handle', 'tool'
(by the grip, the thumb towards the head), 'vessel' (upright, the rim free), 'box' (across the narrow
side), 'dish' (level, by the rim), 'any' (wherever it is firmest), 'auto' (judged by its shape). at: (3,) point of the object to take hold at, its own frame,
metres, scaled. region, avoid: parts of its surface to touch, or not, as (vertices, faces) or mesh
file, scaled as the object is. regrasp: a new grasp even if the clip has one of this object;
keep_grasp: the clip's own even if it is of another one. keep_motion: arms do not give way where
object, hand or forearm go through the person's own body; 'clearance' of the result tells. drink: the person drinks; the cup stands on
the table until the hand takes it, is at the mouth when the hand is, and is put back; neck and head
come to its rim; 'drink' of the result tells.

recipe: 'holdfast' (all terms), 'paper' (the three of IMoS), 'imos-code'. solve: 'sequential', or
'batch' for all frames at once afterwards. weights: dict by term, such as {'penetration': 3000.0}.
contact_threshold_mm: tau. normalize: 'sum' or 'mean', what the weights of E_c and E_t multiply. slip: contacts may travel along the surface. custom_terms: list of
CustomTerm, terms of your own beside those, with solve='sequential'.

hand_over: the object changes hands, in switch_frames (n,), ascending, or where that is found; dwell_s
is how long both hold around a switch that was given.

progress: callable (stage, done, total), False stops. threads 0: all. Returns FitResult. Raises
FitFailure where no hand can hold the object or none touches it, Stopped, and Error.

    held = holdfast.fit('demo_drink', 'mug')
    held.clip.save('held.npz'))";

// One number of each frame.
template <typename Number, typename Frame, typename Get>
py::array_t<Number> PerFrame(const std::vector<Frame>& frames, const Get& get) {
  py::array_t<Number> array(static_cast<py::ssize_t>(frames.size()));
  std::transform(frames.begin(), frames.end(), array.mutable_data(), get);
  return array;
}

py::dict EnergiesOf(const CarriedClip& self) {
  using F = FrameReport;
  const std::vector<F>& frames = self.report.fit.frames;
  py::dict energies("energy_total"_a =
                        PerFrame<double>(frames, [](const F& f) { return f.energy_total; }));
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric == nullptr) continue;
    energies[info.metric] =
        PerFrame<double>(frames, [&](const F& f) { return f.energies[info.term]; });
  }
  for (std::size_t k = 0; k < self.report.fit.custom_terms.size(); ++k) {
    energies[py::str("energy_" + self.report.fit.custom_terms[k])] =
        PerFrame<double>(frames, [&](const F& f) { return f.custom_energies.at(k); });
  }
  return energies;
}

// A list of each name as the array of its type.
py::dict PerFrameDict(const CarriedClip& self) {
  const nlohmann::json columns =
      FitFramesJson(self.report.fit, self.report.contact, self.report.clearance);
  const py::object as_array = py::module_::import("numpy").attr("asarray");
  py::dict arrays;
  for (const auto& [name, column] : columns.items()) {
    const py::object list = ToPython(column);
    arrays[py::str(name)] = name == "stop" ? list : as_array(list);
  }
  return arrays;
}

py::dict FirstGraspOf(const CarriedClip& self) {
  const FirstGrasp& first = self.report.grasp;
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
  return SwitchesJson(self.report.holding, self.report.handovers);
}

const char* HolderOf(const CarriedClip& self) {
  return self.report.held_by == kHoldsRight  ? "right"
         : self.report.held_by == kHoldsLeft ? "left"
                                             : "both";
}

void SaveFit(const CarriedClip& self, const std::filesystem::path& folder, bool force) {
  RequireInRange(*self.clip, "clip");
  RequireNew(folder / "object.ply", force);
  RequireNew(folder / "clip.npz", force);
  const py::gil_scoped_release unlocked;
  std::filesystem::create_directories(folder);
  Clip clip = *self.clip;
  if (clip.object) clip.object->mesh = "object.ply";
  WriteMesh(self.object->object.mesh, folder / "object.ply");
  WriteClip(clip, self.object->object.mesh, folder / "clip.npz");
}

void BindFitResult(py::module_& module) {
  py::class_<CarriedClip, CarriedPtr>(module, "FitResult", "A clip with its object, and how.")
      .def_readonly("clip", &CarriedClip::clip,
                    "Clip with object, fitted fingers and arms, and holding_hand")
      .def_property_readonly(
          "status", [](const CarriedClip&) { return "carried"; },
          "'carried': all else is raised as FitFailure")
      .def_property_readonly(
          "held_by", &HolderOf,
          "'right' or 'left' where that hand alone holds at some time, else 'both'; "
          "who holds in which frame is clip.holding_hand")
      .def_readonly("warnings", &CarriedClip::warnings, "list of str")
      .def_property_readonly("energies", &EnergiesOf,
                             "dict of (T,) arrays by term and unit ('energy_penetration_m2'), "
                             "without weights; 'energy_total' is the weighted sum")
      .def_property_readonly("per_frame", &PerFrameDict,
                             "dict of (T,) arrays: energies, contact, penetration, solver; 'stop' "
                             "is a list of str")
      .def_property_readonly(
          "contact",
          [](const CarriedClip& self) {
            return ToPython(FitSummaryJson(self.report.fit, self.report.contact));
          },
          "dict of numbers: contact and penetration over the clip, frames, contact pairs, frames "
          "that failed, medians of the solve")
      .def_property_readonly("grasp", &FirstGraspOf,
                             "dict: 'made', and of a grasp that was made its measures, 'fingers' "
                             "(45,) and 'wrist_from_object' (4, 4), of both hands by 'right' and "
                             "'left'")
      .def_property_readonly(
          "drink",
          [](const CarriedClip& self) {
            return ToPython(
                DrinkJson(self.report.drink, self.report.drunk.value_or(DrinkMeasures{})));
          },
          "How the person drinks (fit(drink=True)): frames, millimetres, degrees; None for nobody.")
      .def_property_readonly(
          "clearance",
          [](const CarriedClip& self) { return ToPython(ClearanceJson(self.report.clearance)); },
          "dict of numbers: how far the arms gave way to the body, and frames that are still in it")
      .def_property_readonly(
          "switches", [](const CarriedClip& self) { return ToPython(SwitchesOfFit(self)); },
          "list of dict: hand-overs, with frame, from, to, confidence")
      .def_readonly("seconds", &CarriedClip::seconds,
                    "to grasp, fit and measure, the object prepared")
      .def_property_readonly(
          "object", [](const CarriedClip& self) { return MeshTuple(self.object->object.mesh); },
          "(vertices (V, 3) metres, faces (F, 3)) that was fitted, scaled; copies")
      .def_property_readonly("object_name",
                             [](const CarriedClip& self) { return self.object->object.name; })
      .def("save", &SaveFit, "folder"_a, py::kw_only(), "force"_a = false,
           "Writes clip.npz and object.ply into a folder, which is made where it is not there. "
           "Raises Error where it has one of them, which force=True overwrites.")
      .def("__repr__", [](const CarriedClip& self) {
        return fmt::format("<holdfast.FitResult: {} held by {}>", self.object->object.name,
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

CarriedPtr RunFit(FitCall& call, const StagedProgress& progress, std::vector<std::string>& notes) {
  const auto begin = std::chrono::steady_clock::now();
  const Clip& clip = *call.clip.clip;
  auto carried = std::make_shared<CarriedClip>();
  std::shared_ptr<const PreparedObject> object = call.prepared;
  if (!object) {
    object = std::make_shared<const PreparedObject>(
        PrepareObject(call.object, kFitVertices, call.options.threads));
  }
  notes.insert(notes.end(), object->notes.begin(), object->notes.end());
  if (call.options.grasp == GraspSource::kClips) {
    if (const auto away = WarnOfHeldDistance(clip, call.clip.body, object->object.mesh)) {
      carried->warnings.push_back(
          fmt::format("{}: {}: {}", call.clip.name, away->seen, away->advice));
    }
  }
  CarryReport report = NamingSource("the clip", call.clip.name, [&] {
    return CarryObject(clip, call.clip.body, *object, call.options, progress);
  });
  RequireCarried(report, call);
  for (const auto* warnings : {&report.grasp.warnings, &report.warnings}) {
    carried->warnings.insert(carried->warnings.end(), warnings->begin(), warnings->end());
  }
  carried->clip = WithSurface(std::move(report.clip), object->object.mesh);
  carried->report = std::move(report);
  carried->object = std::move(object);
  carried->seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return carried;
}

void BindFit(py::module_& module) {
  BindCustomTerm(module);
  BindFitResult(module);
  module.def(
      "fit", &Fit, "clip"_a, "object"_a = py::none(), py::kw_only(), "hand"_a = "auto",
      "style"_a = "auto", "use"_a = "auto", "at"_a = py::none(), "region"_a = py::none(),
      "avoid"_a = py::none(), "regrasp"_a = false, "keep_grasp"_a = false, "keep_motion"_a = false,
      "drink"_a = false, "recipe"_a = "holdfast", "solve"_a = "sequential",
      "weights"_a = py::none(), "contact_threshold_mm"_a = 10.0, "slip"_a = false,
      "hand_over"_a = false, "first_hand"_a = "auto", "switch_frames"_a = py::none(),
      "max_switches"_a = HandoverSearchOptions{}.max_switches,
      "dwell_s"_a = HandoverSearchOptions{}.dwell_s, "object_scale"_a = 1.0,
      "object_vertices"_a = kFitVertices, "max_iterations"_a = FitOptions{}.max_iterations,
      "precision"_a = "single", "normalize"_a = "sum", "custom_terms"_a = py::none(),
      "body"_a = py::none(), "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(), kFitDoc);
  module.def(
      "offhand",
      [fit = py::object(module.attr("fit"))](const py::object& clip, const py::object& object,
                                             const py::kwargs& options) {
        if (options.contains("hand_over")) {
          throw py::type_error("offhand: hand_over is True; use fit() for what does not change");
        }
        return fit(clip, object, "hand_over"_a = true, **options);
      },
      "clip"_a, "object"_a = py::none(),
      "fit(clip, object, hand_over=True, ...): carries an object through a motion in which it "
      "passes from hand to hand. Options are those of fit().");
  BindRefine(module);
  BindTransfer(module);
  BindGrasp(module);
  BindFrameFitter(module);
}

}  // namespace holdfast::python
