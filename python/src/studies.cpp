// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "generator/scripted/handover_motion.h"
#include "geometry/body/skeleton.h"
#include "geometry/jobs/job_list.h"
#include "geometry/mesh/distance_grid.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"
#include "solver/handover/handover_search.h"
#include "solver/markers/marker_world.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

py::list ReadJobs(const std::filesystem::path& path) {
  py::list jobs;
  for (const JobLine& line : ReadJobList(path)) {
    py::dict keys;
    for (const auto& [key, value] : line.keys) keys[py::str(key)] = value;
    jobs.append(py::dict("name"_a = line.name, "where"_a = line.where, "words"_a = line.words,
                         "keys"_a = keys));
  }
  return jobs;
}

py::list MarkerTrials(const std::filesystem::path& folder) {
  py::list trials;
  for (const MarkerTrialFiles& files : FindMarkerTrials(folder)) {
    py::object still = py::none();
    if (!files.still.empty()) still = py::str(files.still.string());
    trials.append(py::dict("name"_a = files.name, "recording"_a = files.recording.string(),
                           "static"_a = still, "person"_a = files.Person()));
  }
  return trials;
}

py::array_t<double> JointPositions(const py::object& clip, const py::object& body) {
  const ClipArgument input = ClipOf(clip, body);
  const Eigen::Matrix3Xd rest = BodySurface(input.body.model, input.body.betas).RestJoints();
  const int frames = input.clip->NumFrames();
  Eigen::MatrixXd joints(3 * rest.cols(), frames);
  BodyState state;
  for (int t = 0; t < frames; ++t) {
    ForwardJoints(rest, input.clip->pose[t], input.clip->trans.col(t), state);
    joints.col(t) = state.joints.reshaped();
  }
  return Rows(joints).reshape({py::ssize_t{frames}, py::ssize_t{rest.cols()}, py::ssize_t{3}});
}

py::dict LabelsDict(const HoldLabels& labels) {
  const auto frames = static_cast<py::ssize_t>(labels.hands.size());
  return py::dict("holding_hand"_a = py::array_t<std::uint8_t>(frames, labels.hands.data()),
                  "switches"_a = ToPython(SwitchesJson(labels, {})));
}

// Both hands of the clip's person.
std::array<HandModel, 2> HandsOf(const ClipBody& body) {
  RequireHands(*body.model, kHoldsRight | kHoldsLeft);
  return {HandModel(body.model, body.betas, Side::kRight),
          HandModel(body.model, body.betas, Side::kLeft)};
}

py::dict Holds(const py::object& clip, const py::object& object, double object_scale, double cell,
               const py::object& body, int threads) {
  RequirePositive(object_scale, "object_scale");
  RequirePositive(cell, "cell");
  const int workers = ThreadsOf(threads);
  const ClipArgument input = ClipOf(clip, body);
  const LoadedObject loaded = ObjectOf(object, input, object_scale);
  return LabelsDict(RunAside([input, mesh = loaded.mesh, cell, workers] {
    DistanceGridOptions grid;
    grid.cell_m = cell;
    grid.threads = workers;
    const auto [right, left] = HandsOf(input.body);
    return FindHolds(*input.clip, right, left, DistanceGrid(SignedDistance(mesh), grid), workers);
  }));
}

py::dict Handovers(const py::object& clip, double object_size, const py::object& body) {
  RequirePositive(object_size, "object_size");
  const ClipArgument input = ClipOf(clip, body);
  return LabelsDict(RunAside([input, object_size] {
    const auto [right, left] = HandsOf(input.body);
    return FindHandovers(*input.clip, right, left, object_size);
  }));
}

py::tuple HandoverClip(const py::object& object, std::uint64_t seed, double frame_rate,
                       int switches, const std::array<double, 3>& noise, double object_scale,
                       const py::object& body) {
  RequirePositive(object_scale, "object_scale");
  RequirePositive(frame_rate, "frame_rate");
  RequireBetween(switches, "switches", 0, 20);
  for (const double sigma : noise) RequireBetween(sigma, "noise", 0.0, 10.0);
  HandoverOptions options;
  options.seed = seed;
  options.frame_rate = frame_rate;
  options.switches = switches;
  const BodyMeasures measures = MeasureBody(*ModelOf(body), {});
  const LoadedObject loaded = ObjectOf(object, object_scale);
  HandoverMotion motion =
      MakeHandoverMotion(measures, PalmGrasps(measures, loaded.mesh.vertices, seed), options);
  AddNoise(motion.clip, {noise[0], noise[1], noise[2]}, seed);
  return py::make_tuple(WithSurface(std::move(motion.clip), loaded.mesh), motion.switch_frames);
}

}  // namespace

void BindStudies(py::module_& module) {
  module.def("read_jobs", &ReadJobs, "path"_a,
             R"(Reads the jobs of a list such as 'holdfast fit --batch' reads.

Parameters
----------
path : path

Returns
-------
list of dict
    'name' of the result, 'words' (files beside the list as paths), 'keys' (dict of key=value) and
    'where' (file and line, for messages).

Raises
------
Error
    For an invalid line. The message names the line.
)");
  module.def("find_marker_trials", &MarkerTrials, "folder"_a,
             R"(Finds recordings of markers in a folder and those below it.

A file with '_static' in its name is the static trial of those beside it.

Parameters
----------
folder : path

Returns
-------
list of dict
    In the order of their paths: 'name', 'recording', 'static' (the static trial of the same person,
    a path or None) and 'person'.

Raises
------
Error
    For a folder without recordings.
)");
  module.def("joint_positions", &JointPositions, "clip"_a, "body"_a = py::none(),
             R"(Computes the positions of a clip's joints.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
body : BodyModel, optional
    In place of the embedded model.

Returns
-------
array (T, 55, 3)
    Meters, world: of the clip's own shape where its betas are of this body, else of the mean shape.
)");
  module.def("find_holds", &Holds, "clip"_a, "object"_a = py::none(), py::kw_only(),
             "object_scale"_a = 1.0, "cell"_a = DistanceGridOptions{}.cell_m, "body"_a = py::none(),
             "threads"_a = 0,
             R"(Detects which hand holds the object of a clip in each frame.

The clip's object trajectory may be noisy. Its own holding_hand is ignored.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
object : str, path or (vertices, faces), optional
    As in fit().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
cell : float, default 0.002
    Edge of a cell of the object's distance grid, meters.
body : BodyModel, optional
    In place of the embedded model.
threads : int, default 0
    0: all.

Returns
-------
dict
    'holding_hand' (T,): 0 nobody, 1 right, 2 left, 3 both. 'switches', as FitResult.switches.
)");
  module.def("find_handovers", &Handovers, "clip"_a, "object_size"_a, py::kw_only(),
             "body"_a = py::none(),
             R"(Detects where an object would change hands in a clip without object.

Only from the hands (after Ghosh et al. 2023, section 5.7).

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
object_size : float
    Middle extent of the object's three, meters.
body : BodyModel, optional
    In place of the embedded model.

Returns
-------
dict
    As of find_holds().

Raises
------
Error
    If the hands never meet.
)");
  module.def("handover_clip", &HandoverClip, "object"_a, py::kw_only(), "seed"_a = 1,
             "frame_rate"_a = 30.0, "switches"_a = 0, "noise"_a = std::array{0.0, 0.0, 0.0},
             "object_scale"_a = 1.0, "body"_a = py::none(),
             R"(Generates a clip of a standing person who passes the object from hand to hand.

The object is in flat palms. The same seed gives the same clip.

Parameters
----------
object : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
seed : int, default 1
frame_rate : float, default 30.0
    Hz.
switches : int, default 0
    Number of hand-overs; 0 draws one to three.
noise : (float, float, float), default [0.0, 0.0, 0.0]
    Standard deviations per axis and frame of the object's position (meters) and rotation (radians)
    and of every joint (radians).
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.

Returns
-------
clip : Clip
    With the true holding_hand.
switch_frames : list of int
)");
}

}  // namespace holdfast::python
