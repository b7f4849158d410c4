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

/// What the weights of E_c and E_t multiply.
enum class Normalization {
  kSum,  ///< sums over pairs and coordinates, as the paper writes them
  /// Means, as its code has them: E_d, E_c and E_t each divided by their number of pairs or
  /// coordinates, all three then times the number of pairs of E_d. E_d is what it is with kSum, and
  /// weights beyond the paper keep their meaning.
  kMean,
};

/// Options of the object optimizer. The first group is the paper's (IMoS, Ghosh et al. 2023, eq.
/// 5-9); its values are the defaults. Weights multiply sums, as there. The paper leaves tau open: 1
/// cm is its code's. The second group goes beyond the paper.
struct FitOptions {
  double lambda_distance = 1.0;                   ///< weight of E_d
  double lambda_contact = 0.005;                  ///< weight of E_c
  double lambda_temporal = 0.005;                 ///< weight of E_t
  Normalization normalize = Normalization::kSum;  ///< of E_c and E_t
  double contact_threshold_m = 0.01;  ///< tau: first-frame pairs closer than this are in contact

  double lambda_penetration = 3000.0;     ///< weight of E_p, hand in object
  double lambda_object_in_hand = 3000.0;  ///< weight of E_o, object in hand
  double soft_tissue_m = 0.0005;          ///< depth that neither of them minds
  double lambda_limits = 100.0;           ///< weight of angles beyond a joint's range, 1/rad^2
  double lambda_wrist = 300.0;            ///< weight of E_w, where two hands hold
  double release_s = 0.4;                 ///< a hand takes this long to come and go

  bool slip = false;            ///< E_s in place of E_d and E_c: contacts may travel
  double lambda_slip = 3000.0;  ///< weight of E_s
  double drag_share = 0.01;     ///< of that, for travel along the surface
  double slip_touch_m = 0.003;  ///< vertices this close touch when the hand takes hold
  double lambda_fingers = 0.0;  ///< weight of the fingers' way from the clip's own, 1/rad^2
  double lambda_object = 0.0;   ///< weight of the object's way from the clip's own, 1/m^2

  bool whole_clip = false;              ///< all frames at once, after one another
  int threads = 1;                      ///< whole clip: to evaluate on; the result is the same
  double lambda_acceleration = 2000.0;  ///< whole clip: weight of second differences, 1/m^2
  double lambda_support = 1e5;          ///< whole clip: weight of where an object rests, 1/m^2

  std::vector<CustomTerm> custom_terms;  ///< the user's, beside those above; frame by frame only

  PairPrecision precision = PairPrecision::kSingle;
  int max_iterations = 50;           ///< Levenberg-Marquardt iterations per frame
  double step_tolerance = 1e-5;      ///< stop when a step is this small against the unknowns
  double function_tolerance = 1e-9;  ///< or when the cost changes by this share

  /// Weights of the sums, for one hand of a frame: `pairs` of E_d, `contacts` of E_c.
  double ContactWeight(double pairs, double contacts) const;
  double TemporalWeight(double pairs) const;

  /// These options with the paper's three terms and nothing else.
  FitOptions OnlyPaper() const;
};

/// An object as the fit sees it, const and shareable. Terms that need what is not there are off.
struct FitObject {
  Eigen::Matrix3Xd vertices;                     ///< (3 x M), simplified: for E_d and E_c
  std::shared_ptr<const DistanceGrid> distance;  ///< of the full mesh: for E_p
  Eigen::Matrix3Xd surface;                      ///< (3 x n), dense samples: for E_o
};

/// Prepares an object for all terms. `mesh` at full resolution with its signed distance,
/// `simplified` for the pair terms, on up to `threads` threads.
FitObject MakeFitObject(const TriangleMesh& mesh, const SignedDistance& surface,
                        const TriangleMesh& simplified, int threads);

/// Terms of the fit's energy. Those up to kObjectInHand are reported frame by frame.
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

/// What is known of a term: all that weights, reports and command lines need.
struct EnergyTermInfo {
  EnergyTerm term;
  const char* name;            ///< "object_in_hand"
  double FitOptions::*weight;  ///< 0: the term is off
  bool in_paper;               ///< IMoS, eq. 7 to 9
  const char* metric;          ///< its column of metrics.json, by frame, with unit; null: none
  const char* help;            ///< of its weight
};

/// All terms, in the order of EnergyTerm.
std::span<const EnergyTermInfo> EnergyTerms();
/// Options of the weights by their names ("lambda_contact"), of the terms that `wanted` takes.
void AddWeightOptions(OptionTable& table, FitOptions& options,
                      const std::function<bool(const EnergyTermInfo&)>& wanted);

/// Energies of one frame without weights, all hands together.
class Energies {
 public:
  double& operator[](EnergyTerm term) { return values_.at(static_cast<std::size_t>(term)); }
  double operator[](EnergyTerm term) const { return values_.at(static_cast<std::size_t>(term)); }
  Energies& operator+=(const Energies& more);
  /// The weighted sum.
  double Total(const FitOptions& options) const;

 private:
  std::array<double, kNumReportedEnergies> values_{};
};

}  // namespace holdfast
