// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/body/body_frames.h"
#include "geometry/parallel.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

using JointColumns = Eigen::Matrix<double, 3, kNumJoints>;

// Surface kept with a model between calls: in an optimizer loop betas and vertices do not change,
// and preparing them takes longer than a frame.
struct PersonSurface {
  Eigen::VectorXd betas;
  std::optional<std::vector<int>> vertex_ids;
  std::shared_ptr<const BodySurface> surface;
};

PersonSurface SurfaceOf(const py::object& self, const py::object& betas,
                        const py::object& vertex_ids) {
  const ModelPtr model = self.cast<ModelPtr>();
  PersonSurface person;
  if (!betas.is_none()) person.betas = Vector(betas, "betas");
  if (!vertex_ids.is_none()) {
    const py::array_t<int> ids = Integers(vertex_ids, "vertex_ids", {-1});
    person.vertex_ids.emplace(ids.data(), ids.data() + ids.size());
  }
  if (py::hasattr(self, "_surface") && py::isinstance<PersonSurface>(self.attr("_surface"))) {
    const py::object kept = self.attr("_surface");
    const auto& last = kept.cast<const PersonSurface&>();
    if (last.betas.size() == person.betas.size() && last.betas == person.betas &&
        last.vertex_ids == person.vertex_ids) {
      return last;
    }
  }
  {
    const py::gil_scoped_release unlocked;
    person.surface = person.vertex_ids ? std::make_shared<const BodySurface>(model, person.betas,
                                                                             *person.vertex_ids)
                                       : std::make_shared<const BodySurface>(model, person.betas);
  }
  self.attr("_surface") = py::cast(person);
  return person;
}

// Motion argument of both calls.
struct Motion {
  Motion(const py::object& poses, const py::object& trans_or_none)
      : pose(Poses(poses, "poses")), trans(Eigen::Matrix3Xd::Zero(3, Frames())) {
    if (!trans_or_none.is_none()) trans = Columns(trans_or_none, "trans", Frames());
  }
  py::ssize_t Frames() const { return static_cast<py::ssize_t>(pose.size()); }

  std::vector<JointPose> pose;
  Eigen::Matrix3Xd trans;
};

// The number of blocks does not depend on the number of threads, so neither do sums over blocks.
constexpr py::ssize_t kBlocks = 64;

py::ssize_t BlockBegin(py::ssize_t block, py::ssize_t frames) {
  return block * frames / std::min(frames, kBlocks);
}

// Calls run(begin, states) for posed runs of up to kFramesTogether frames from `begin` on. The
// frames of a block are processed in order by one thread.
void ForFrames(const Motion& motion, const BodySurface& surface, int threads,
               const std::function<void(py::ssize_t, std::span<const BodyState>)>& run) {
  const py::ssize_t frames = motion.Frames(), blocks = std::min(frames, kBlocks);
  const py::ssize_t together =
      std::max<py::ssize_t>(1, kFramesTogether * blocks / std::max<py::ssize_t>(1, frames));
  RunWithProgress(py::none(), [&](const StagedProgress& progress) {
    const auto groups = static_cast<int>((blocks + together - 1) / together);
    ParallelFor(groups, threads, [&](int group) {
      thread_local std::vector<BodyState> states(kFramesTogether);  // the thread ends soon
      const py::ssize_t last = std::min(blocks, (group + 1) * together);
      const py::ssize_t end = BlockBegin(last, frames);
      for (py::ssize_t t = BlockBegin(group * together, frames); t < end; t += kFramesTogether) {
        if (!progress("frames", 0, 0)) return;
        const py::ssize_t count = std::min<py::ssize_t>(kFramesTogether, end - t);
        const std::span<BodyState> posed(states.data(), static_cast<std::size_t>(count));
        ForwardFrames(surface, std::span(motion.pose).subspan(t, count),
                      motion.trans.middleCols(t, count), posed);
        run(t, posed);
      }
    });
  });
}

py::array_t<double> Zeros(std::vector<py::ssize_t> shape) {
  py::array_t<double> array(std::move(shape));
  std::fill_n(array.mutable_data(), array.size(), 0.0);
  return array;
}

py::tuple PoseBody(const py::object& self, const py::object& poses, const py::object& trans,
                   const py::object& betas, const py::object& vertex_ids, int threads) {
  const Motion motion(poses, trans);
  const int used = ThreadsOf(threads);
  const PersonSurface person = SurfaceOf(self, betas, vertex_ids);
  const py::ssize_t n = person.surface->NumVertices();
  py::array_t<double> vertices({motion.Frames(), n, py::ssize_t{3}});
  py::array_t<double> joints({motion.Frames(), py::ssize_t{kNumJoints}, py::ssize_t{3}});
  double* const vertex_rows = vertices.mutable_data();
  double* const joint_rows = joints.mutable_data();
  ForFrames(motion, *person.surface, used, [&](py::ssize_t t, std::span<const BodyState> states) {
    for (const BodyState& state : states) {
      Eigen::Map<Eigen::Matrix3Xd>(vertex_rows + 3 * n * t, 3, n) = state.vertices;
      Eigen::Map<JointColumns>(joint_rows + state.joints.size() * t++) = state.joints;
    }
  });
  return py::make_tuple(vertices, joints);
}

py::tuple PullBack(const py::object& self, const py::object& poses, const py::object& trans,
                   const py::object& betas, const py::object& grad_vertices,
                   const py::object& grad_joints, const py::object& vertex_ids, int threads,
                   bool with_betas) {
  const Motion motion(poses, trans);
  const py::ssize_t frames = motion.Frames();
  const int used = ThreadsOf(threads);
  if (grad_vertices.is_none() && grad_joints.is_none()) {
    throw py::value_error("expected grad_vertices, grad_joints or both, got None for both");
  }
  const PersonSurface person = SurfaceOf(self, betas, vertex_ids);
  const BodySurface& surface = *person.surface;
  const py::ssize_t n = grad_vertices.is_none() ? 0 : surface.NumVertices();
  const py::array_t<double> by_vertices =
      grad_vertices.is_none() ? Zeros({0}) : Floats(grad_vertices, "grad_vertices", {frames, n, 3});
  const py::array_t<double> by_joints =
      grad_joints.is_none() ? Zeros({frames, kNumJoints, 3})
                            : Floats(grad_joints, "grad_joints", {frames, kNumJoints, 3});
  py::array_t<double> by_poses({frames, py::ssize_t{3 * kNumJoints}});
  py::array_t<double> by_trans({frames, py::ssize_t{3}});
  const double* const vertex_rows = by_vertices.data();
  const double* const joint_rows = by_joints.data();
  double* const pose_rows = by_poses.mutable_data();
  double* const trans_rows = by_trans.mutable_data();

  struct RestSum {
    Eigen::Matrix3Xd vertices;
    JointColumns joints = JointColumns::Zero();
  };
  std::vector<RestSum> sums(static_cast<std::size_t>(with_betas ? kBlocks : 0));
  ForFrames(motion, surface, used, [&](py::ssize_t t, std::span<const BodyState> states) {
    thread_local std::vector<BodyGradient> of_run(kFramesTogether);
    const std::span<BodyGradient> gradients(of_run.data(), states.size());
    const auto count = static_cast<py::ssize_t>(states.size());
    VertexAdjointFrames(
        surface, states, Eigen::Map<const Eigen::Matrix3Xd>(vertex_rows + 3 * n * t, 3, n * count),
        Eigen::Map<const Eigen::Matrix3Xd>(joint_rows + 3 * kNumJoints * t, 3, kNumJoints * count),
        gradients);
    py::ssize_t block = 0;
    for (const BodyGradient& gradient : gradients) {
      Eigen::Map<JointPose>(pose_rows + gradient.pose.size() * t) = gradient.pose;
      Eigen::Map<Eigen::Vector3d>(trans_rows + 3 * t) = gradient.trans;
      if (with_betas) {
        while (BlockBegin(block + 1, frames) <= t) ++block;
        RestSum& sum = sums[static_cast<std::size_t>(block)];
        if (sum.vertices.cols() == 0) sum.vertices.setZero(3, surface.NumVertices());
        sum.vertices += gradient.rest_vertices;
        sum.joints += gradient.rest_joints;
      }
      ++t;
    }
  });
  if (!with_betas) return py::make_tuple(by_poses, by_trans);
  RestSum all{Eigen::Matrix3Xd::Zero(3, surface.NumVertices())};
  Eigen::VectorXd by_betas;
  {
    const py::gil_scoped_release unlocked;
    for (const RestSum& sum : sums) {
      if (sum.vertices.cols() > 0) all.vertices += sum.vertices;
      all.joints += sum.joints;
    }
    by_betas =
        ShapeGradient(surface, all.vertices, all.joints, static_cast<int>(person.betas.size()));
  }
  return py::make_tuple(by_poses, by_trans, py::array_t<double>(by_betas.size(), by_betas.data()));
}

py::tuple JointNames() {
  py::tuple names(kNumJoints);
  for (std::size_t j = 0; j < kNumJoints; ++j) {
    names[j] = py::str(kJointNames[j].data(), kJointNames[j].size());
  }
  return names;
}

template <typename Class>
void BindProperties(Class& model) {
  model
      .def_property_readonly(
          "name", [](const BodyModel& self) { return self.Name(); }, "str: name of the file")
      .def_property_readonly("num_vertices", &BodyModel::NumVertices, "number of vertices")
      .def_property_readonly("num_shape", &BodyModel::NumShape, "number of usable betas")
      .def_property_readonly(
          "faces", [](const BodyModel& self) { return Rows(self.Faces()); },
          "(F, 3) vertex ids, counter-clockwise seen from outside; a copy")
      .def_property_readonly(
          "joint_names", [](const BodyModel&) { return JointNames(); }, "55 names, as JOINT_NAMES")
      .def_property_readonly(
          "joint_parents", [](const BodyModel&) { return py::tuple(py::cast(kJointParents)); },
          "parent of each of the 55 joints, -1 for the pelvis; always less than the joint")
      .def(
          "hand_vertex_ids",
          [](const BodyModel& self, const std::string& side) {
            const std::vector<int>& ids = self.HandVertexIds(
                Choice<Side>(side, "side", {{"right", Side::kRight}, {"left", Side::kLeft}}));
            return py::array_t<int>(static_cast<py::ssize_t>(ids.size()), ids.data());
          },
          "side"_a, R"(Returns the vertices of a hand, ascending: for vertex_ids.

Parameters
----------
side : {'right', 'left'}

Returns
-------
array (n,) of int
)")
      .def("__repr__", [](const BodyModel& self) {
        return fmt::format("<holdfast.BodyModel: {}, {} vertices>", self.Name(),
                           self.NumVertices());
      });
}

}  // namespace

void BindBody(py::module_& module) {
  module.attr("JOINT_NAMES") = JointNames();
  py::class_<BodyModel, std::shared_ptr<BodyModel>> model(
      module, "BodyModel", py::dynamic_attr(),
      R"(A body model of SMPL-X's 55 joints, from files of SMPL-X, SMPL-H and MANO or embedded.

Examples
--------
>>> vertices, joints = holdfast.BodyModel.load()(clip.poses, clip.trans, clip.betas)
)");
  py::class_<PersonSurface>(model, "_Surface");
  BindProperties(model);
  model
      .def_static(
          "load",
          [](const std::optional<std::filesystem::path>& path) -> ModelPtr {
            ModelPtr loaded;
            {
              const py::gil_scoped_release unlocked;
              loaded = path ? BodyModel::Load(*path) : BodyModel::Default();
            }
            if (const std::string note = loaded->ShapeNote(); !note.empty()) LogNotes({note});
            return loaded;
          },
          "path"_a = py::none(),
          R"(Reads SMPL-X (v1.0, v1.1), SMPL-H or MANO as downloaded, .npz or .pkl.

Nothing in the file is executed.

Parameters
----------
path : path, optional
    Default: the model that comes with Holdfast.

Returns
-------
BodyModel

Raises
------
Error
    If the file is not a body model. The message names the field.
)")
      .def("__call__", &PoseBody, "poses"_a, "trans"_a = py::none(), "betas"_a = py::none(),
           "vertex_ids"_a = py::none(), "threads"_a = 0,
           R"(Poses the body.

Parameters
----------
poses : array_like (T, 165) or (T, 55, 3)
    Axis-angle in radians, with complete finger angles (flat_hand_mean=True). Also rotation
    matrices (T, 55, 3, 3), or 6D (T, 55, 6), as in Clip().
trans : array_like (T, 3), optional
    Meters; the pelvis is at J_0 + trans. Default: zero.
betas : array_like (B,), optional
    Shape coefficients. Fewer than num_shape count as zero.
vertex_ids : array_like (V,) of int, optional
    Vertices to pose, in this order; an empty array of ints: joints only. Default: all.
threads : int, default 0
    0: all.

Returns
-------
vertices : array (T, V, 3)
    Meters, in the frame of trans.
joints : array (T, 55, 3)
    The same.

Raises
------
Error
    For more betas than the model has, and for vertex ids out of range.
)")
      .def("vjp", &PullBack, "poses"_a, "trans"_a, "betas"_a, "grad_vertices"_a = py::none(),
           "grad_joints"_a = py::none(), "vertex_ids"_a = py::none(), "threads"_a = 0,
           py::kw_only(), "with_betas"_a = false,
           R"(Backpropagates a loss through the call with the same arguments.

Exact (hand-written reverse mode), including the pose blend shapes. Independent of threads.

Parameters
----------
poses : array_like (T, 165) or (T, 55, 3)
trans : array_like (T, 3) or None
betas : array_like (B,) or None
    Arguments of the call.
grad_vertices : array_like (T, V, 3), optional
grad_joints : array_like (T, 55, 3), optional
    Gradients of the loss with respect to the returned arrays, one or both.
vertex_ids : array_like (V,) of int, optional
    Argument of the call.
threads : int, default 0
    0: all.
with_betas : bool, default False
    Also return the gradient with respect to betas.

Returns
-------
grad_poses : array (T, 165)
grad_trans : array (T, 3)
grad_betas : array (B,)
    With with_betas; summed over the frames.
)");
}

}  // namespace holdfast::python
