// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "geometry/report/report_page.h"

namespace holdfast {

/// Data of one clip for a page: compact, with vertex errors up to `surface_error_mm`.
struct ReportClip {
  nlohmann::json header;  ///< names, sizes, curves, facts, notes, the payload's directory
  ReportPayload payload;
  int directions = 0;
  double surface_error_mm = 0.0;
};

/// Builds a clip's data. Payload arrays (T frames, V body vertices, H hand vertices, right first):
///
///   rest f32 (V,3)               shaped rest vertices
///   faces u16|u32 (F,3)
///   directions i16 (K,3V)        pose correctives; times direction_scale f32 (K) meters
///   coefficients f32 (T,K)
///   weight_count u8 (V), weight_joint u8, weight_value f32: skinning weights, ragged by vertex
///   joint_rotation f32 (T,55,4)  world rotation, quaternion x y z w
///   joint_offset f32 (T,55,3)    skinning: v = sum_j w_j (R_j v_p + offset_j)
///   joint_rest f32 (55,3)
///   hand_vertices u16|u32 (H)
///   distance i8 (T,H)            signed distance to the object in 0.1 mm, clamped to +-12.7 mm;
///                                each frame as the difference from the previous (modulo 256)
///   object_vertices f32          duplicated along creases
///   object_normals i16           unit, times 32767
///   object_faces u16|u32
///   object_pose f32 (T,7)        quaternion, translation
///   table_vertices, table_normals, table_faces, table_pose: the same, if there is a table
///   marker_vertices f32, marker_faces u16|u32: in the world, goals and the input's marker, if any
///
/// Without contact data in metrics.json, skin closer to the object than the threshold is in
/// contact. `header.check` holds vertices of the body model that the page compares with its own.
ReportClip MakeReportClip(const ReportInput& input, double contact_threshold_mm = 5.0,
                          int threads = 1);

/// Goals in the metrics of 'holdfast reach', world, meters: of the wrist, or of an object that is
/// carried (3 G x 1); of a moving goal one per frame (3 x T). Empty without goals.
Eigen::MatrixXd GoalsIn(const nlohmann::json& metrics);

/// Display name of a clip: of its folder, its file's stem, or the embedded clip.
std::string ReportName(const ReportInput& input);

}  // namespace holdfast
