// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Adds the arrays that WriteClip writes to a file that holds more than a clip.
void AddArrays(const Clip& clip, NpzWriter& writer);

/// Writes a clip whose `object->mesh` names the file of this mesh, with the mesh's checksum
/// (`object_checksum`), so that a different mesh of the same file name is detected.
void WriteClip(const Clip& clip, const TriangleMesh& object, const std::filesystem::path& path);

/// Writes the files of a clip with an object to `folder`: clip.npz, object.ply, and table.ply if
/// the clip has a table with a mesh.
void WriteClipFiles(Clip clip, const TriangleMesh& object, const std::filesystem::path& folder);

/// Returns the mesh of a clip's table; null if it has no table, or one of unknown shape.
inline const TriangleMesh* TableMesh(const Clip& clip) {
  return clip.table ? clip.table->surface.get() : nullptr;
}

/// Checksum of a mesh as stored in files: vertices in single precision, in order, and faces.
std::string MeshChecksum(const TriangleMesh& mesh);

/// Remedy for a clip's missing or different mesh.
inline constexpr const char* kMeshRemedy =
    "Restore the clip's mesh, or give it with --object (transfer: --from-object)";

/// Reads holding_hand of a clip's file: bits per frame (1 right, 2 left). Throws Error for a shape
/// other than (frames) and for other values.
std::vector<std::uint8_t> HoldingHandOf(const NpyMember& member, Eigen::Index frames);

/// Returns the checksum of the object's mesh stored in a clip (.npz); empty for clips without, and
/// other files.
std::string MeshChecksumIn(const std::filesystem::path& clip);

/// Throws Error if a clip's file has a checksum of its object's mesh that differs from that of
/// `mesh`, read from the file `source`.
void RequireMeshOf(const std::filesystem::path& clip, const TriangleMesh& mesh,
                   const std::string& source);

/// Returns the clip's betas, or zeros in AMASS's number: loaders expect a non-empty shape.
Eigen::VectorXd WrittenBetas(const Clip& clip);

/// Returns the offset that ReadClip adds to `trans` of an archive, meters. The array `rest_pelvis`
/// of a clip of the embedded body is the J_0 that its trans refers to. Clips without it predate the
/// SMPL-X pelvis of that body; their J_0 was the origin. Zero for clips of other models, and for
/// those with a rest surface of their own, which defines J_0.
Eigen::Vector3d PelvisOffset(const NpzReader& archive);

/// Note about that offset of trans. Nothing if there is none.
std::optional<std::string> OldPelvisNote(const NpzReader& archive);

/// Whether an archive with arrays of these names is a clip written by Holdfast: it has a motion and
/// an array that only Holdfast's clips have.
bool IsHoldfastClip(std::span<const std::string> names);

/// Whether it has only arrays that WriteClip writes, and not just the concatenated joints, which
/// may be another model's.
bool HasOnlyClipArrays(std::span<const std::string> names);

/// Wraps axis-angles beyond half a turn to the equal rotation within it, in all joints but the
/// root, whose angle may accumulate through a clip. Later code depends on rotations, not on their
/// representation. Returns a note on the change; empty if nothing changed.
std::string WrapJointAngles(Clip& clip);

/// Rounds body and object to single-precision values: half the bytes once compressed, a tenth of a
/// micrometer.
void RoundToFloat(Clip& clip);

/// Mirrors a clip at x = 0, and its object and table, each at x = 0 of its own frame. For a
/// symmetric body and the object's mesh mirrored, the scene is exactly mirrored. `root` is the rest
/// pelvis J_0 of the body (meters), about which poses rotate.
Clip MirrorClip(const Clip& clip, const Eigen::Vector3d& root);

/// Mirrors a mesh at x = 0; faces stay outward.
TriangleMesh MirrorMesh(TriangleMesh mesh);

}  // namespace holdfast
