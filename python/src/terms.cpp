// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "geometry/parallel.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/kernels/pair_kernel.h"
#include "solver/terms/hand/paper_terms.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

using RowTable = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Arguments of pairwise terms.
struct PairInput {
  Eigen::Matrix3Xd hand, object;                        // (3 x N), (3 x M)
  py::array_t<double> reference_array;                  // owns the data of `reference`
  Eigen::Map<const RowTable> reference{nullptr, 0, 0};  // (N x M)
};

PairInput PairsOf(const py::object& hand, const py::object& object, const py::object& reference) {
  PairInput in{Columns(hand, "hand"), Columns(object, "object"), {}};
  in.reference_array = Floats(reference, "reference", {in.hand.cols(), in.object.cols()});
  new (&in.reference)
      Eigen::Map<const RowTable>(in.reference_array.data(), in.hand.cols(), in.object.cols());
  return in;
}

// Runs short work directly, since threads cost more to start than a million pairs. Other work can
// be stopped by Ctrl-C. Both wait for the end, because the caller owns the output.
void ForPairs(Eigen::Index pairs, const std::function<void(bool many)>& work) {
  if (pairs > 1'000'000) {
    RunWithProgress(py::none(), [&](const StagedProgress&) { work(true); });
  } else {
    const py::gil_scoped_release unlocked;
    work(false);
  }
}

py::array_t<double> PairDistances(const py::object& hand, const py::object& object) {
  const Eigen::Matrix3Xd from = Columns(hand, "hand"), to = Columns(object, "object");
  RequireMemory(static_cast<double>(from.cols()), static_cast<double>(to.cols()), "hand, object");
  py::array_t<double> distances({from.cols(), to.cols()});
  Eigen::Map<Eigen::MatrixXd> columns(distances.mutable_data(), to.cols(), from.cols());
  ForPairs(distances.size(), [&](bool) {
    ParallelFor(static_cast<int>(from.cols()), 1,
                [&](int i) { columns.col(i) = HandObjectDistance::Distances(from.col(i), to); });
  });
  return distances;
}

// An energy and its gradients, in the form returned to Python.
struct PairEnergy {
  double energy = 0.0;
  Eigen::Matrix3Xd hand, object;

  py::tuple Tuple() const { return py::make_tuple(energy, Rows(hand), Rows(object)); }
};

// Energy of the points against the targets, and its gradient with respect to the points.
double DistanceGradient(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& targets,
                        const RowTable& reference, int threads, Eigen::Matrix3Xd& gradient) {
  constexpr int kChunk = 128;
  const PairTargets<double> fixed(targets);
  const int count = static_cast<int>(points.cols());
  RowTable padded = RowTable::Zero(count, fixed.Stride());
  padded.leftCols(reference.cols()) = reference;
  std::vector<PairSums> sums(static_cast<std::size_t>(count));
  ParallelFor((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    const int begin = chunk * kChunk;
    SumPairs(BestIsa(), fixed, points.col(begin).data(), std::min(kChunk, count - begin),
             padded.row(begin).data(), sums.data() + begin);
  });
  gradient.resize(3, count);
  double energy = 0.0;
  for (int i = 0; i < count; ++i) {
    const PairSums& sum = sums[static_cast<std::size_t>(i)];
    gradient.col(i) = 2.0 * Eigen::Map<const Eigen::Vector3d>(sum.gradient);
    energy += sum.squares;
  }
  return energy;
}

py::tuple DistanceEnergy(const py::object& hand, const py::object& object,
                         const py::object& reference, int threads) {
  const PairInput in = PairsOf(hand, object, reference);
  PairEnergy result{0.0, Eigen::Matrix3Xd::Zero(3, in.hand.cols()),
                    Eigen::Matrix3Xd::Zero(3, in.object.cols())};
  const int count = ThreadsOf(threads);
  if (in.reference.size() > 0) {
    ForPairs(in.reference.size(), [&](bool many) {
      const int used = many ? count : 1;
      result.energy = DistanceGradient(in.hand, in.object, in.reference, used, result.hand);
      DistanceGradient(in.object, in.hand, in.reference.transpose(), used, result.object);
    });
  }
  return result.Tuple();
}

py::tuple ContactEnergy(const py::object& hand, const py::object& object,
                        const py::object& reference, double threshold_m) {
  const PairInput in = PairsOf(hand, object, reference);
  if (!(threshold_m > 0.0)) throw py::value_error("threshold_m: expected more than 0 m");
  PairEnergy result{0.0, Eigen::Matrix3Xd::Zero(3, in.hand.cols()),
                    Eigen::Matrix3Xd::Zero(3, in.object.cols())};
  ForPairs(in.reference.size(), [&](bool) {
    ParallelFor(static_cast<int>(in.hand.cols()), 1, [&](int i) {
      for (Eigen::Index j = 0; j < in.object.cols(); ++j) {
        if (in.reference(i, j) >= threshold_m) continue;
        const Eigen::Vector3d apart = in.hand.col(i) - in.object.col(j);
        result.energy += apart.squaredNorm();
        result.hand.col(i) += 2.0 * apart;
        result.object.col(j) -= 2.0 * apart;
      }
    });
  });
  return result.Tuple();
}

py::tuple PenetrationEnergy(const py::object& points, const py::object& signed_distance,
                            double give_m, int threads) {
  if (!py::hasattr(signed_distance, "gradient")) {
    throw py::type_error("signed_distance: expected a SignedDistance, got " +
                         TypeText(signed_distance));
  }
  if (!(give_m >= 0.0)) throw py::value_error("give_m: expected 0 m or more");
  const py::tuple answer = signed_distance.attr("gradient")(points, "threads"_a = threads);
  const Eigen::VectorXd distance = Vector(answer[0], "distances");
  Eigen::Matrix3Xd gradient = Columns(answer[1], "gradients", distance.size());
  const Eigen::VectorXd depth = (-distance.array() - give_m).max(0.0);
  gradient *= (-2.0 * depth).asDiagonal();
  return py::make_tuple(depth.squaredNorm(), Rows(gradient));
}

}  // namespace

void BindTerms(py::module_& module) {
  module.def("pair_distances", &PairDistances, "hand"_a, "object"_a,
             R"(Computes the distances |h_i - o_j| of two sets of points.

Parameters
----------
hand : array_like (N, 3)
object : array_like (M, 3)
    Points in the same frame, meters.

Returns
-------
array (N, M)
    In the frame in which the hand takes hold, the reference D of distance_energy() and
    contact_energy().
)");
  module.def("distance_energy", &DistanceEnergy, "hand"_a, "object"_a, "reference"_a, py::kw_only(),
             "threads"_a = 0,
             R"(Computes E_d = sum_ij (|h_i - o_j| - D_ij)^2 (IMoS, eq. 7).

It keeps the distances of hand and object. Gradients are exact; where two points coincide, the
direction is zero.

Parameters
----------
hand : array_like (N, 3)
object : array_like (M, 3)
    Points in the same frame, meters.
reference : array_like (N, M)
    D, meters, as of pair_distances().
threads : int, default 0
    0: all.

Returns
-------
energy : float
grad_hand : array (N, 3)
grad_object : array (M, 3)
)");
  module.def(
      "contact_energy", &ContactEnergy, "hand"_a, "object"_a, "reference"_a, "threshold_m"_a = 0.01,
      R"(Computes E_c = sum |h_i - o_j|^2 over the pairs with D_ij < threshold_m (IMoS, eq. 8).

It keeps contacts together.

Parameters
----------
hand : array_like (N, 3)
object : array_like (M, 3)
    Points in the same frame, meters.
reference : array_like (N, M)
    D, meters, as of pair_distances().
threshold_m : float, default 0.01

Returns
-------
energy : float
grad_hand : array (N, 3)
grad_object : array (M, 3)
)");
  module.def("penetration_energy", &PenetrationEnergy, "points"_a, "signed_distance"_a,
             "give_m"_a = 0.0, py::kw_only(), "threads"_a = 0,
             R"(Computes sum_i max(0, -d(p_i) - give_m)^2 for points in a surface.

Parameters
----------
points : array_like (N, 3)
    In the frame of the surface, meters.
signed_distance : SignedDistance
    d, negative inside.
give_m : float, default 0.0
    Depths up to this are free, meters.
threads : int, default 0
    0: all.

Returns
-------
energy : float
grad_points : array (N, 3)
)");
}

}  // namespace holdfast::python
