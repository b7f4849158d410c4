// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/robot/robot_hand.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// Arguments of ObjectTrack().
py::tuple StateOfTrack(const ObjectTrack& track) {
  return py::make_tuple(Rows(track.trans), Rows(track.orient), track.name, track.mesh,
                        track.surface ? MeshTuple(*track.surface) : py::object(py::none()));
}

using Labels = ContactLabels::Matrix;

py::dict StateOfClip(const Clip& clip) {
  py::array_t<double> poses(
      {static_cast<py::ssize_t>(clip.NumFrames()), py::ssize_t{3 * kNumJoints}});
  for (int t = 0; t < clip.NumFrames(); ++t) {
    std::copy_n(clip.pose[t].data(), 3 * kNumJoints, poses.mutable_data(t, 0));
  }
  py::object contact = py::none();
  if (clip.contact) contact = py::make_tuple(Rows(clip.contact->object), Rows(clip.contact->body));
  return py::dict("poses"_a = poses, "trans"_a = Rows(clip.trans), "frame_rate"_a = clip.frame_rate,
                  "betas"_a = py::array_t<double>(clip.betas.size(), clip.betas.data()),
                  "texts"_a = py::make_tuple(clip.gender, clip.surface_model_type, clip.body_model,
                                             clip.subject, clip.action),
                  "object"_a = clip.object, "table"_a = clip.table,
                  "v_template"_a = Rows(clip.v_template), "contact"_a = contact,
                  "holding"_a = clip.holding_hand);
}

Labels LabelsOf(const py::handle& value) {
  const py::array_t<int> rows = Integers(value, "contact", {-1, -1});
  Labels labels(rows.shape(1), rows.shape(0));
  for (py::ssize_t t = 0; t < rows.shape(0); ++t) {
    for (py::ssize_t v = 0; v < rows.shape(1); ++v) {
      labels(v, t) = static_cast<std::uint8_t>(rows.at(t, v));
    }
  }
  return labels;
}

ClipPtr ClipOfState(const py::dict& state) {
  auto clip = std::make_shared<Clip>();
  clip->pose = Poses(state["poses"], "poses");
  clip->trans = Columns(state["trans"], "trans", clip->NumFrames());
  clip->frame_rate = state["frame_rate"].cast<double>();
  clip->betas = Vector(state["betas"], "betas");
  const auto texts = state["texts"].cast<std::vector<std::string>>();
  if (texts.size() != 5) throw py::value_error("texts: expected five");
  std::string* const fields[] = {&clip->gender, &clip->surface_model_type, &clip->body_model,
                                 &clip->subject, &clip->action};
  for (std::size_t k = 0; k < texts.size(); ++k) *fields[k] = texts[k];
  clip->object = state["object"].cast<std::optional<ObjectTrack>>();
  clip->table = state["table"].cast<std::optional<ObjectTrack>>();
  clip->v_template = Columns(state["v_template"], "v_template");
  if (!state["contact"].is_none()) {
    const auto parts = state["contact"].cast<py::tuple>();
    clip->contact = ContactLabels{LabelsOf(parts[0]), LabelsOf(parts[1])};
  }
  clip->holding_hand = state["holding"].cast<std::vector<std::uint8_t>>();
  return clip;
}

// Arguments of BodyModel.load().
py::tuple StateOfBody(const BodyModel& body) {
  if (body.IsSubject()) {
    throw py::type_error("a body with a subject's own surface is not pickled: pickle the clip");
  }
  if (body.Source() == BodyModel::Default()->Source()) return py::make_tuple(py::none());
  return py::make_tuple(body.Source());
}

}  // namespace

void BindPickling(py::module_& module) {
  module.def("_clip", &ClipOfState, "state"_a);
  module.def("_state", &StateOfClip, "clip"_a);
  module.def("_state", &StateOfTrack, "track"_a);
  module.def("_state", &StateOfBody, "body"_a);
  module.def(
      "_state", [](const RobotHand& robot) { return py::make_tuple(robot.source); }, "robot"_a);
  module.def(
      "_save",
      [](const Clip& clip, const py::object& object, const std::filesystem::path& folder,
         const std::string& metrics, bool force) {
        RequireInRange(clip, "clip");
        const bool held = !object.is_none();
        for (const char* name : {"clip.npz", "object.ply", "metrics.json"}) {
          if (held || std::string_view(name) != "object.ply") RequireNew(folder / name, force);
        }
        const TriangleMesh mesh = held ? MeshArgument(object, "object") : TriangleMesh();
        const py::gil_scoped_release unlocked;
        std::filesystem::create_directories(folder);
        if (held) {
          WriteClipFiles(clip, mesh, folder);
        } else {
          WriteClip(clip, folder / "clip.npz");
        }
        WriteAtomically(folder / "metrics.json", metrics);
      },
      "clip"_a, "object"_a, "folder"_a, "metrics"_a, "force"_a);
}

}  // namespace holdfast::python
