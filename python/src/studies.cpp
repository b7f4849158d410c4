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
             "The jobs of a list such as 'holdfast fit --batch' reads: a list of dict with 'name' "
             "of the result, 'words' (files beside the list as paths), 'keys' (dict of "
             "key=value) and 'where' (file and line, for messages). Raises Error naming the line.");
  module.def("find_marker_trials", &MarkerTrials, "folder"_a,
             "Recordings of markers in a folder and those below it, in the order of their paths: a "
             "list of dict with 'name', 'recording', 'static' (the static trial of the same "
             "person, a path or None) and 'person'. A file with '_static' in its name is the "
             "static trial of those beside it. Raises Error for a folder without recordings.");
  module.def("joint_positions", &JointPositions, "clip"_a, "body"_a = py::none(),
             "Positions (T, 55, 3) of the joints of a clip (Clip, path or embedded name), meters "
             "in the world: of the clip's own shape where its betas are of this body, else of the "
             "mean shape.");
  module.def("find_holds", &Holds, "clip"_a, "object"_a = py::none(), py::kw_only(),
             "object_scale"_a = 1.0, "cell"_a = DistanceGridOptions{}.cell_m, "body"_a = py::none(),
             "threads"_a = 0,
             "Detects who holds the object of a clip that has its trajectory, noisy or not. "
             "Returns a dict of 'holding_hand' (T,) (0 nobody, 1 right, 2 left, 3 both) and "
             "'switches', as FitResult.switches. The clip's own holding_hand is ignored. object as "
             "for fit(); cell: edge of a cell of the object's distance grid, meters.");
  module.def(
      "find_handovers", &Handovers, "clip"_a, "object_size"_a, py::kw_only(), "body"_a = py::none(),
      "Detects where an object would change hands in a clip without object: as find_holds(), but "
      "only from the hands (after Ghosh et al. 2023, section 5.7). object_size: its middle extent "
      "of three, meters. Raises Error if the hands never meet.");
  module.def(
      "handover_clip", &HandoverClip, "object"_a, py::kw_only(), "seed"_a = 1,
      "frame_rate"_a = 30.0, "switches"_a = 0, "noise"_a = std::array{0.0, 0.0, 0.0},
      "object_scale"_a = 1.0, "body"_a = py::none(),
      "A synthetic clip of a standing person who passes the object from hand to hand, in flat "
      "palms: (Clip, frames of the switches), with the true holding_hand. switches: 0 draws one to "
      "three. noise: standard deviations per axis and frame of the object's position (meters) and "
      "rotation (radians) and of every joint (radians). The same seed gives the same clip.");
}

}  // namespace holdfast::python
