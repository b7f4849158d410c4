// SPDX-License-Identifier: MIT
#include "geometry/io/markers/marker_recording.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/error.h"
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/hand_keypoints.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/markers/marker_json.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

py::dict RecordingDict(const MarkerRecording& recording) {
  const py::ssize_t frames = recording.NumFrames(), markers = recording.NumMarkers();
  return py::dict(
      "names"_a = recording.names, "rate_hz"_a = recording.rate_hz,
      "positions"_a = Rows(recording.positions).reshape({frames, markers, py::ssize_t{3}}),
      "unit"_a = recording.unit, "format"_a = recording.format, "notes"_a = recording.notes);
}

py::dict Read(const std::filesystem::path& path) {
  return RecordingDict(RunAside([path] { return ReadMarkers(path); }));
}

// Missing markers are NaN in all three coordinates.
Eigen::MatrixXd MarkerPositions(const py::handle& value, std::size_t markers,
                                const std::string& name) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(
        fmt::format("{}: expected numbers (T, M, 3), got {}", name, TypeText(value)));
  }
  if (array.ndim() != 3 || array.shape(1) != static_cast<py::ssize_t>(markers) ||
      array.shape(2) != 3 || array.shape(0) == 0) {
    throw py::value_error(fmt::format(
        "{}: expected an array (T, {}, 3), meters, one marker per name, NaN if not visible", name,
        markers));
  }
  Eigen::MatrixXd positions =
      Eigen::Map<const Eigen::MatrixXd>(array.data(), 3 * array.shape(1), array.shape(0));
  for (double& x : positions.reshaped()) {
    if (std::isinf(x)) throw py::value_error(name + ": expected finite numbers or NaN, got inf");
  }
  for (Eigen::Index t = 0; t < positions.cols(); ++t) {
    for (std::size_t m = 0; m < markers; ++m) {
      auto place = positions.block<3, 1>(static_cast<Eigen::Index>(3 * m), t);
      if (place.hasNaN()) place.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return positions;
}

MarkerRecording RecordingOf(const py::object& given, const char* name) {
  if (IsPath(given)) {
    const auto path = py::module_::import("os").attr("fspath")(given).cast<std::filesystem::path>();
    return RunAside([path] { return ReadMarkers(path); });
  }
  if (!py::isinstance<py::dict>(given)) {
    throw py::type_error(fmt::format(
        "{}: expected a file of markers, or a dict with names, positions and rate_hz as "
        "read_markers() gives, got {}",
        name, TypeText(given)));
  }
  const auto dict = given.cast<py::dict>();
  for (const char* key : {"names", "positions", "rate_hz"}) {
    if (!dict.contains(key)) throw py::value_error(fmt::format("{}: has no '{}'", name, key));
  }
  MarkerRecording recording;
  const auto names = dict["names"].cast<std::vector<std::string>>();
  if (names.empty())
    throw py::value_error(fmt::format("{}['names']: expected one name or more", name));
  SetMarkerNames(names, fmt::format("{}['names']", name), recording);
  recording.rate_hz = dict["rate_hz"].cast<double>();
  RequirePositive(recording.rate_hz, "rate_hz");
  recording.positions =
      MarkerPositions(dict["positions"], names.size(), fmt::format("{}['positions']", name));
  recording.unit = "m";
  recording.meters_per_unit = 1.0;
  return recording;
}

ObjectMarkers PlacesOf(const py::dict& given) {
  ObjectMarkers markers;
  markers.places.resize(3, static_cast<Eigen::Index>(given.size()));
  for (const auto& [name, value] : given) {
    const auto place =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!py::isinstance<py::str>(name) || !place || place.ndim() != 1 || place.shape(0) != 3) {
      PyErr_Clear();
      throw py::value_error("object_markers: expected names with three numbers each, meters");
    }
    const auto column = static_cast<Eigen::Index>(markers.names.size());
    markers.names.push_back(name.cast<std::string>());
    markers.places.col(column) = Eigen::Map<const Eigen::Vector3d>(place.data());
  }
  if (!markers.places.allFinite()) {
    throw py::value_error("object_markers: expected finite positions, meters");
  }
  return markers;
}

// Sets the markers of an object from a table file, names, or a dict of places, and its mesh.
void SetObject(const py::object& object, const py::object& object_markers, double scale,
               const MarkerRecording& recording, const std::string& where,
               SolveMarkersOptions& options, std::optional<LoadedObject>& mesh) {
  if (object_markers.is_none()) {
    if (!object.is_none()) {
      throw py::value_error(
          "object_markers: expected a table (.csv) or a dict of positions of the object's markers "
          "in its mesh frame, got None");
    }
    return;
  }
  if (py::isinstance<py::dict>(object_markers)) {
    options.object = PlacesOf(object_markers.cast<py::dict>());
  } else if (IsPath(object_markers)) {
    const auto text = py::str(object_markers).cast<std::string>();
    options.object = ObjectMarkersOf(text, recording, where);
  } else {
    throw py::type_error(
        fmt::format("object_markers: expected a table (.csv), names or a dict of positions, got {}",
                    TypeText(object_markers)));
  }
  if (object.is_none()) return;
  if (options.object->places.cols() == 0) {
    throw py::value_error(
        "object_markers: names do not define where the markers are on the mesh: expected a table "
        "(.csv) or a dict of positions");
  }
  mesh = ObjectOf(object, scale);
}

// Names of the markers at fingertips.
py::list FingertipMarkers(const MarkerReport& report) {
  py::list names;
  for (const SolvedMarker& marker : report.markers) {
    if (marker.site.joint >= kLeftHandBegin && marker.site.toward < 0) {
      names.append(marker.site.name);
    }
  }
  return names;
}

py::tuple Solve(const py::object& recording, const py::object& still,
                const std::optional<std::filesystem::path>& table, const py::object& object,
                const py::object& object_markers, double object_scale, const py::object& body,
                const py::object& progress, const py::kwargs& given) {
  SolveMarkersOptions options;
  SetOptions(given, OptionsOf(options));
  const ModelPtr model = ModelOf(body);
  const MarkerRecording trial = RecordingOf(recording, "recording");
  std::optional<MarkerRecording> resting;
  if (!still.is_none()) resting = RecordingOf(still, "static");
  if (table) {
    options.table = options.table.With(MarkerTable::Read(*table, JointOfVertices(model)));
  }
  const std::string where =
      IsPath(recording) ? py::str(recording).cast<std::string>() : std::string("recording");
  std::optional<LoadedObject> mesh;
  SetObject(object, object_markers, object_scale, trial, where, options, mesh);
  SolvedRecording solved;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    solved = SolveMarkers(trial, resting ? &*resting : nullptr, model, options, where, go_on);
  });
  if (!solved.report.converged) throw FitFailure(where + ": the solve failed");
  if (mesh) solved.clip.object->name = mesh->name;
  py::dict told = ToPython(MarkerReportJson(solved.report));
  told["repaired"] = RecordingDict(RepairedMarkers(trial, solved));
  const py::ssize_t frames = solved.carried.cols(), markers = solved.carried.rows() / 3;
  told["carried"] = Rows(solved.carried).reshape({frames, markers, py::ssize_t{3}});
  told["fingertips"] = FingertipMarkers(solved.report);
  return py::make_tuple(mesh ? WithSurface(std::move(solved.clip), mesh->mesh)
                             : std::make_shared<Clip>(std::move(solved.clip)),
                        told);
}

// A hand's keypoints as an array, or from a file.
std::vector<KeypointTable> KeypointsOf(const py::object& keypoints) {
  if (IsPath(keypoints)) {
    const auto path = keypoints.cast<std::filesystem::path>();
    return RunAside([path] { return ReadHandKeypoints(path); });
  }
  const py::array_t<double> array = Floats(keypoints, "keypoints", {-1, -1, 3}, true);
  const bool known = std::ranges::any_of(
      KeypointOrders(), [&](const KeypointOrder& order) { return order.count == array.shape(1); });
  if (array.shape(0) == 0 || !known) {
    throw py::value_error(
        fmt::format("keypoints: expected (T, N, 3) of N = 21, 25 or 26 points, got ({}, {}, 3)",
                    array.shape(0), array.shape(1)));
  }
  KeypointTable table;
  table.points = static_cast<int>(array.shape(1));
  table.positions =
      Eigen::Map<const Eigen::MatrixXd>(array.data(), 3 * array.shape(1), array.shape(0));
  return {std::move(table)};
}

py::tuple SolveHand(const py::object& keypoints, const py::object& progress,
                    const py::kwargs& given) {
  KeypointOptions options;
  SetOptions(given, OptionsOf(options));
  const std::vector<KeypointTable> tables = KeypointsOf(keypoints);
  const std::string where =
      IsPath(keypoints) ? py::str(keypoints).cast<std::string>() : std::string("keypoints");
  SolvedKeypoints solved;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    solved = SolveKeypoints(tables, options, where, go_on);
  });
  py::dict told = ToPython(KeypointReportJson(solved.report));
  told["notes"] = solved.report.notes;
  return py::make_tuple(std::make_shared<Clip>(std::move(solved.clip)), told);
}

void Write(const std::filesystem::path& path, const py::object& recording, bool force) {
  const MarkerRecording given = RecordingOf(recording, "recording");
  RequireNew(path, force);
  RunAside([&] { WriteC3d(given, path); });
}

constexpr const char* kSolveMarkersDoc =
    R"(Fits a moving body to labeled optical markers.

First solves body shape and marker placement (as MoSh, Loper et al. 2014), then the poses of all
frames, with wrong labels corrected.

Parameters
----------
recording : dict or path
    A file, or a dict as of read_markers() ('names', 'positions' (T, M, 3) meters, 'rate_hz').
static : dict or path, optional
    Recording of the same person and markers at rest.
table : path, optional
    File (.csv) of additional marker names (name,joint,vertex,cluster).
object : str, path or (vertices, faces), optional
    Mesh of the object that object_markers are on.
object_markers : path, dict or str, optional
    Also solves the object's pose: a file (.csv: name,x,y,z) or a dict of positions of its markers
    in its mesh frame, meters, or their names ('cup_a,cup_b,cup_c', or 'cup_*').
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
clip : Clip
    T frames at the recording's rate, z up.
report : dict
    'rms_mm', 'markers', 'swaps', 'outliers', 'unmarked_joints' and more. 'repaired' is the
    recording, a dict as of read_markers(), with labels corrected, outliers and gaps filled.
    'carried' (T, M, 3) has the positions of 'markers' on the solved body, meters in the recording's
    axes. 'fingertips' has the names of markers on fingertips.

Raises
------
FitFailure
    If the solve fails.
Stopped
    If progress returns False.
Error
    For unknown names and for recordings that do not determine a pose.

Examples
--------
>>> clip, report = holdfast.solve_markers('drink.c3d', static='rest.c3d')
)";

constexpr const char* kSolveKeypointsDoc =
    R"(Fits a hand to keypoints of a detector, a glove or a headset, frame by frame.

Finger angles are within their ranges. The wrist is free.

Parameters
----------
keypoints : array_like (T, N, 3) or path
    N = 21, 25 or 26 points, NaN if not seen; or a file of such an array.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
clip : Clip
    Clip of a hand alone, z up, meters.
report : dict
    'hand' ('right', 'left'), 'order', 'meters_per_unit' of the keypoints, 'size_ratio' of the hand
    to the model's, 'rms_mm' from the keypoints, 'next_best_rms_mm' of another side or order,
    'frames_without_hand', 'notes'.

Raises
------
Error
    For keypoints that fit no hand.
Stopped
    If progress returns False.

Examples
--------
>>> clip, report = holdfast.solve_keypoints(landmarks, up='-y')
)";

}  // namespace

void BindMarkers(py::module_& module) {
  module.def("read_markers", &Read, "path"_a,
             R"(Reads labeled markers of a C3D, TRC, Vicon CSV or Qualisys TSV file, gzipped or not.

Parameters
----------
path : path

Returns
-------
dict
    'names' (list of M), 'positions' (T, M, 3) meters in the file's axes, NaN where a marker is not
    visible, 'rate_hz', 'unit' of the file, 'format', 'notes'.

Raises
------
Error
    For a file of another format or a malformed file.

Examples
--------
>>> drink = holdfast.read_markers('drink.c3d')
)");
  module.def("write_markers", &Write, "path"_a, "recording"_a, py::kw_only(), "force"_a = false,
             R"(Writes a recording as a C3D file, atomically.

Floats, millimeters, residual -1 where a marker is not visible.

Parameters
----------
path : path
recording : dict or path
    Dict as of read_markers(), or a file of markers.
force : bool, default False
    Overwrite an existing file.

Raises
------
Error
    For data that the format cannot store, and if the file exists, unless force=True.

Examples
--------
>>> holdfast.write_markers('drink.c3d', holdfast.read_markers('drink.tsv'))
)");
  SolveMarkersOptions usual;
  module.def("solve_markers", &Solve, "recording"_a, py::kw_only(), "static"_a = py::none(),
             "table"_a = py::none(), "object"_a = py::none(), "object_markers"_a = py::none(),
             "object_scale"_a = 1.0, "body"_a = py::none(), "progress"_a = py::none(),
             WithOptions(kSolveMarkersDoc, OptionsOf(usual)).c_str());
  KeypointOptions keypoints;
  module.def("solve_keypoints", &SolveHand, "keypoints"_a, py::kw_only(), "progress"_a = py::none(),
             WithOptions(kSolveKeypointsDoc, OptionsOf(keypoints)).c_str());
}

}  // namespace holdfast::python
