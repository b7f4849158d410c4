// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/options.h"
#include "geometry/rotation.h"
#include "solver/fit/custom_term.h"
#include "solver/terms/hand/paper_terms.h"

namespace holdfast {

/// Normalization of E_c and E_t, on which their weights act.
enum class Normalization {
  kSum,  ///< sums over pairs and coordinates, as in the paper
  /// Means, as in the paper's code: E_d, E_c and E_t each divided by their number of pairs or
  /// coordinates, all three then times the number of pairs of E_d. E_d is the same as with kSum,
  /// and weights beyond the paper keep their meaning.
  kMean,
};

/// Options of the object optimizer. The first group is the paper's (IMoS, Ghosh et al. 2023, eq.
/// 5-9), with its values as defaults. Weights multiply sums, as there. The paper does not specify
/// tau; 1 cm is from its code. The second group goes beyond the paper.
struct FitOptions {
  double lambda_distance = 1.0;                   ///< weight of E_d
  double lambda_contact = 0.005;                  ///< weight of E_c
  double lambda_temporal = 0.005;                 ///< weight of E_t
  Normalization normalize = Normalization::kSum;  ///< of E_c and E_t
  double contact_threshold_m = 0.01;  ///< tau: first-frame pairs closer than this are in contact

  double lambda_penetration = 3000.0;     ///< weight of E_p, hand in object
  double lambda_object_in_hand = 3000.0;  ///< weight of E_o, object in hand
  double soft_tissue_m = 0.0005;          ///< depth that E_p and E_o ignore
  double lambda_limits = 100.0;           ///< weight of angles beyond a joint's range, 1/rad^2
  double lambda_wrist = 300.0;            ///< weight of E_w, where two hands hold
  double release_s = 0.4;                 ///< blend time before and after a hold

  bool slip = false;            ///< E_s instead of E_d and E_c: contacts may slide
  double lambda_slip = 3000.0;  ///< weight of E_s
  double drag_share = 0.01;     ///< fraction of that, for sliding along the surface
  double slip_touch_m = 0.003;  ///< contact threshold at the start of the hold
  double lambda_fingers = 0.0;  ///< weight of finger deviation from the clip, 1/rad^2
  double lambda_object = 0.0;   ///< weight of object deviation from the clip, 1/m^2

  bool whole_clip = false;              ///< solve all frames jointly after the frame-by-frame fit
  int threads = 1;                      ///< whole clip: for evaluation; no effect on the result
  double lambda_acceleration = 2000.0;  ///< whole clip: weight of second differences, 1/m^2
  double lambda_support = 1e5;          ///< whole clip: weight of resting poses, 1/m^2

  std::vector<CustomTerm> custom_terms;  ///< user-defined terms; frame-by-frame fit only

  PairPrecision precision = PairPrecision::kSingle;
  int max_iterations = 50;           ///< Levenberg-Marquardt iterations per frame
  double step_tolerance = 1e-5;      ///< stop when the relative step is this small
  double function_tolerance = 1e-9;  ///< or when the relative cost change is

  /// Weights of the sums, for one hand of a frame: `pairs` of E_d, `contacts` of E_c.
  double ContactWeight(double pairs, double contacts) const;
  double TemporalWeight(double pairs) const;

  /// Returns these options with the paper's three terms only.
  FitOptions OnlyPaper() const;
};

/// Object data for the fit; const and shareable. Terms whose data are missing are off.
struct FitObject {
  Eigen::Matrix3Xd vertices;                     ///< (3 x M), simplified mesh, for E_d and E_c
  std::shared_ptr<const DistanceGrid> distance;  ///< of the full mesh, for E_p
  Eigen::Matrix3Xd surface;                      ///< (3 x n), dense samples, for E_o
};

/// Prepares an object for all terms, on up to `threads` threads. `mesh`: full resolution, with its
/// signed distance; `simplified`: for the pair terms.
FitObject MakeFitObject(const TriangleMesh& mesh, const SignedDistance& surface,
                        const TriangleMesh& simplified, int threads);

/// Terms of the fit's energy. Those up to kObjectInHand are reported per frame.
enum class EnergyTerm {
  kDistance,
  kContact,
  kTemporal,
  kSlip,
  kPenetration,
  kObjectInHand,
  kLimits,
  kWrist,
  kFingers,
  kObject,
  kAcceleration,
  kSupport,
};
inline constexpr int kNumReportedEnergies = static_cast<int>(EnergyTerm::kObjectInHand) + 1;

/// Metadata of a term for weights, reports and command lines.
struct EnergyTermInfo {
  EnergyTerm term;
  const char* name;            ///< "object_in_hand"
  double FitOptions::*weight;  ///< 0 disables the term
  bool in_paper;               ///< IMoS, eq. 7 to 9
  const char* metric;          ///< its per-frame column in metrics.json, with unit; null: none
  const char* help;            ///< help text of its weight
};

/// All terms, in the order of EnergyTerm.
std::span<const EnergyTermInfo> EnergyTerms();
/// Adds options for the weights, by name ("lambda_contact"), of the terms that `wanted` accepts.
void AddWeightOptions(OptionTable& table, FitOptions& options,
                      const std::function<bool(const EnergyTermInfo&)>& wanted);

/// Unweighted energies of one frame, summed over all hands.
class Energies {
 public:
  double& operator[](EnergyTerm term) { return values_.at(static_cast<std::size_t>(term)); }
  double operator[](EnergyTerm term) const { return values_.at(static_cast<std::size_t>(term)); }
  Energies& operator+=(const Energies& more);
  /// Weighted sum.
  double Total(const FitOptions& options) const;

 private:
  std::array<double, kNumReportedEnergies> values_{};
};

}  // namespace holdfast
