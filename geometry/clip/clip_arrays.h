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

/// The arrays that WriteClip writes, added to a file that holds more than a clip.
void AddArrays(const Clip& clip, NpzWriter& writer);

/// Writes a clip whose `object->mesh` names a file that holds this mesh, with a checksum of it
/// (`object_checksum`): another mesh of the file's name is then told from it.
void WriteClip(const Clip& clip, const TriangleMesh& object, const std::filesystem::path& path);

/// Of a mesh as files store it: vertices in single precision, in their order, and faces.
std::string MeshChecksum(const TriangleMesh& mesh);

/// What to do where a clip's own mesh is missing or another.
inline constexpr const char* kMeshRemedy =
    "Put that mesh back, or say which one is meant with --object (transfer: --from-object)";

/// holding_hand of a clip's file: bits a frame (1 right, 2 left). Throws Error for another shape
/// than (frames) and for other values.
std::vector<std::uint8_t> HoldingHandOf(const NpyMember& member, Eigen::Index frames);

/// The checksum of its object's mesh that a clip (.npz) has; empty for clips without, and other
/// files.
std::string MeshChecksumIn(const std::filesystem::path& clip);

/// Throws Error where a clip's file has a checksum of its object's mesh and `mesh`, as the file
/// `source` holds it, has another.
void RequireMeshOf(const std::filesystem::path& clip, const TriangleMesh& mesh,
                   const std::string& source);

/// The clip's betas, or as many zeros as AMASS's files have: loaders take a shape of some length.
Eigen::VectorXd WrittenBetas(const Clip& clip);

/// What ReadClip adds to `trans` of an archive, meters. A clip of the embedded body says by its
/// array `rest_pelvis` which J_0 its trans goes with. One without it is from before that body had
/// SMPL-X's, when its J_0 was the origin. Zero for clips of other models, and for those with a rest
/// surface of their own, whose J_0 is of that.
Eigen::Vector3d PelvisOffset(const NpzReader& archive);

/// For people: that trans was moved so, and by how much. Nothing where it was not.
std::optional<std::string> OldPelvisNote(const NpzReader& archive);

/// Whether an archive with arrays of these names is a clip that Holdfast wrote: it has a motion,
/// and an array that only Holdfast's clips have.
bool IsHoldfastClip(std::span<const std::string> names);

/// Whether it has no array but those that WriteClip writes, and not the joints in one array alone,
/// which may be another model's.
bool HasOnlyClipArrays(std::span<const std::string> names);

/// Turns of joints beyond half a turn become the equal ones within it, in all joints but the root,
/// whose angle may grow through a clip: what follows sees rotations, not how they were written.
/// Returns what was done, for people; empty when nothing was.
std::string WrapJointAngles(Clip& clip);

/// Rounds body and object to values that a float can hold: half the bytes once packed, a tenth of a
/// micrometer.
void RoundToFloat(Clip& clip);

/// A clip in a mirror at x = 0, its object and table too, each mirrored at x = 0 of its own frame:
/// of a body that is symmetric, with the object's mesh mirrored, the very same scene. `root` is the
/// pelvis J_0 of the body at rest (meters), about which poses turn.
Clip MirrorClip(const Clip& clip, const Eigen::Vector3d& root);

/// A mesh mirrored at x = 0, its faces outwards still.
TriangleMesh MirrorMesh(TriangleMesh mesh);

}  // namespace holdfast
