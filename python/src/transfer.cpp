// SPDX-License-Identifier: MIT
#include "solver/transfer/transfer.h"

#include <optional>
#include <utility>

#include <pybind11/stl.h>

#include "geometry/error.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/carry/carry_json.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

struct TransferredClip {
  ClipPtr clip;
  TransferReport report;  // without its clip
  SurfaceMapReport map;
  LoadedObject object;
};
using TransferredPtr = std::shared_ptr<TransferredClip>;

// One factor, or one per axis.
Eigen::Vector3d ScaleOf(const py::object& scale) {
  if (scale.is_none()) return Eigen::Vector3d::Ones();
  if (const py::array any = py::array::ensure(scale); any && any.ndim() == 0) {
    const py::object one = py::module_::import("numpy").attr("atleast_1d")(scale);
    return Eigen::Vector3d::Constant(Vector(Floats(one, "scale", {1}), "scale")(0));
  }
  return Vector(Floats(scale, "scale", {3}), "scale");
}

SurfaceMap MapOf(const py::object& map, const TriangleMesh& from, const TriangleMesh& to) {
  if (IsPath(map)) return SurfaceMap::FromFile(from, to, map.cast<std::string>());
  if (!py::isinstance<py::tuple>(map) || py::len(map) != 2) {
    throw py::type_error(
        "map: expected (points on the clip's object (n, 3), points on the other "
        "(n, 3)) or a path, got " +
        TypeText(map));
  }
  const py::tuple sides = map;
  return SurfaceMap::Given(from, to, Columns(sides[0], "map[0]"), Columns(sides[1], "map[1]"));
}

TransferredPtr Transfer(const py::object& clip, const py::object& object, const py::object& scale,
                        const py::object& map, const py::object& betas,
                        const py::object& from_object, double object_scale, const py::object& body,
                        std::uint64_t seed, int threads, const py::object& progress,
                        const py::kwargs& given) {
  TransferOptions options;
  SetOptions(given, OptionsOf(options));
  options.carry.seed = seed;
  options.carry.threads = ThreadsOf(threads);
  RequirePositive(object_scale, "object_scale");
  if (!map.is_none() && object.is_none()) throw py::value_error("map: needs object");
  const Eigen::Vector3d factors = ScaleOf(scale);
  ModelOf(body);
  const ClipArgument input = ClipOf(clip, body);
  if (!input.clip->object) {
    throw Error(input.name, "has no object: there is nothing to transfer",
                "Fit one to it first: fit(clip, object)");
  }
  const LoadedObject first = ObjectOf(from_object, input, 1.0);
  auto result = std::make_shared<TransferredClip>();
  result->object = object.is_none() ? first : ObjectOf(object, object_scale);
  const SurfaceMap scaled = SurfaceMap::Scaled(first.mesh, factors);  // throws if invalid
  result->object.mesh.vertices = factors.asDiagonal() * result->object.mesh.vertices;
  RequireHandheld(result->object);
  ClipBody to = input.body;
  if (!betas.is_none()) to.betas = Vector(betas, "betas");
  const auto from_prepared = PrepareAside(first, options.object_vertices, options.carry.threads);
  const auto to_prepared =
      PrepareAside(result->object, options.object_vertices, options.carry.threads);
  LogNotes(to_prepared->notes);
  std::optional<SurfaceMap> used;
  if (!map.is_none()) used = MapOf(map, from_prepared->object.mesh, to_prepared->object.mesh);
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    if (!used) {
      used = object.is_none()
                 ? scaled
                 : SurfaceMap::Registered(from_prepared->object.mesh, to_prepared->object.mesh);
    }
    result->report = NamingSource("the clip", input.name, [&] {
      return TransferClip(*input.clip, input.body, *from_prepared, to, *to_prepared, *used, options,
                          go_on);
    });
  });
  result->map = used->Report();
  if (result->report.carried.status == CarryStatus::kStopped) throw Stopped();
  if (result->report.carried.status == CarryStatus::kNoContact) {
    throw FitFailure(input.name + ": no hand touches " + result->object.name + " in any frame");
  }
  LogNotes(result->report.warnings);
  LogNotes(result->report.carried.warnings);
  result->clip = WithSurface(std::move(result->report.carried.clip), result->object.mesh);
  return result;
}

constexpr const char* kTransferDoc =
    R"(Transfers a clip with a held object to another object of the same kind, or to another person.

Contacts are kept: a dense map between the objects' surfaces maps contact points and distances. Then
hand and object are fitted.

Parameters
----------
clip : Clip, str or path
    Clip, result, file, folder, or name of an embedded clip, with an object (its mesh, or
    from_object).
object : str, path or (vertices, faces), optional
    Target object, as in fit(). Default: the clip's own.
scale : float or array_like (3,), optional
    Factor, or one for each axis.
map : (array_like (n, 3), array_like (n, 3)) or path, optional
    Corresponding points, meters, or a path to them. Default: found from the shapes.
betas : array_like (B,), optional
    Shape of another person.
from_object : str, path or (vertices, faces), optional
    Mesh of the clip's object.
object_scale : float, default 1.0
    Multiplies the object's coordinates.
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
TransferResult

Raises
------
FitFailure
    If no hand touches the object.
Stopped
    If progress returns False.
Error
    For invalid input.

Examples
--------
>>> held = holdfast.fit('demo_drink', 'mug')
>>> large = holdfast.transfer(held.clip, scale=1.2)
>>> large.clip.save('large.npz')
)";

}  // namespace

void BindTransfer(py::module_& module) {
  py::class_<TransferredClip, TransferredPtr>(module, "TransferResult",
                                              "A clip with another object, or by another person.")
      .def_readonly("clip", &TransferredClip::clip, "Clip with object, arms and fingers fitted")
      .def_property_readonly(
          "map", [](const TransferredClip& self) { return ToPython(MapJson(self.map)); },
          "dict: stretch of the map between the surfaces, and the distance that it leaves between "
          "them")
      .def_property_readonly(
          "holds",
          [](const TransferredClip& self) {
            return ToPython(TransferredHoldsJson(self.report.holds));
          },
          "list of dict: for each hold, whether its grasp is clean or a new one was searched, and "
          "how far contacts are from their mapped points")
      .def_property_readonly(
          "following",
          [](const TransferredClip& self) { return ToPython(FollowingJson(self.report)); },
          "dict: which trajectory was kept, and how body and arms followed")
      .def_property_readonly(
          "contact",
          [](const TransferredClip& self) {
            return ToPython(ContactJson(self.report.carried.contact));
          },
          "dict of numbers: contact and penetration")
      .def_property_readonly(
          "warnings", [](const TransferredClip& self) { return self.report.warnings; },
          "list of str")
      .def_property_readonly(
          "object", [](const TransferredClip& self) { return MeshTuple(self.object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)), scaled; copies")
      .def("__repr__", [](const TransferredClip& self) {
        return fmt::format("<holdfast.TransferResult: {} held by {}>", self.object.name,
                           HoldersText(CountHeld(self.clip->holding_hand)));
      });
  TransferOptions options;
  module.def("transfer", &Transfer, "clip"_a, "object"_a = py::none(), py::kw_only(),
             "scale"_a = py::none(), "map"_a = py::none(), "betas"_a = py::none(),
             "from_object"_a = py::none(), "object_scale"_a = 1.0, "body"_a = py::none(),
             "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kTransferDoc, OptionsOf(options)).c_str());
}

}  // namespace holdfast::python
