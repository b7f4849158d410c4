// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// How a marker is tied to the body.
enum class MarkerTie {
  kSkin,      ///< glued to the skin at a place that its name tells to about a centimeter
  kLandmark,  ///< over a bony landmark: its place from the joint is anatomy
  kCluster,   ///< one of a rigid plate somewhere on the segment: its place is found
};
std::string_view MarkerTieName(MarkerTie tie);

/// Where a marker of this name sits: on the way from a joint to the next, then outwards.
struct MarkerSite {
  std::string name;
  int joint = 0;                                      ///< that it follows
  int toward = -1;                                    ///< joint; -1: the limb's end
  double fraction = 0.0;                              ///< of the way there
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  ///< meters, axes of the T-pose
  MarkerTie tie = MarkerTie::kCluster;
  double sigma_m = 0.04;  ///< how well that tells the place
  int vertex = -1;        ///< of the body model, in place of all that
};

/// Sites by name, any case.
class MarkerTable {
 public:
  /// Names of upper-limb cluster sets, of Plug-in Gait and its kin (CMU's Vicon set, CGM2), and a
  /// glove's: docs/markers.md lists them.
  static const MarkerTable& Known();
  /// This table with the sites of `other` added; those that have a name of this one replace it.
  MarkerTable With(const MarkerTable& other) const;
  /// A text of comma-separated columns with a head: name and joint or vertex, optional cluster.
  /// A marker with a cluster is tied to the joint's bone somewhere; one with a vertex is on the
  /// skin there; with a joint alone, somewhere about it. `num_vertices` and `joint_of_vertex` are
  /// of the body. Throws Error naming file and line.
  static MarkerTable Read(const std::filesystem::path& path,
                          const std::vector<int>& joint_of_vertex);

  void Add(MarkerSite site) { sites_.push_back(std::move(site)); }
  const MarkerSite* Find(std::string_view name) const;
  const std::vector<MarkerSite>& Sites() const { return sites_; }
  /// The site whose name is nearest to one that is not known, with the letters between them. Case,
  /// '_', '-', '.' and blanks do not count, "right" and "left" are R and L. The table is not empty.
  std::pair<const MarkerSite*, int> Nearest(std::string_view name) const;

 private:
  std::vector<MarkerSite> sites_;
};

}  // namespace holdfast
