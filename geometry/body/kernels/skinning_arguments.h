// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

namespace holdfast::kernels {

/// One person in several frames, side by side: every number that a frame has stands in a row of
/// `frames` doubles, a multiple of kFrameQuantum.
struct SkinningArguments {
  /// Pose blend shapes of a joint, as in BodySurface::PoseDirBlock.
  struct Block {
    const int* vertices;  ///< ascending
    long count;
    const double* dirs;    ///< 3 x 9 a vertex, row-major
    const float* feature;  ///< R - I, row-major: 9 rows; null where they are zeros in all frames
  };

  long frames;
  const Block* blocks;
  int num_blocks;
  const double* rest;                  ///< v_s, 3 numbers a vertex
  const std::pair<int, double>* skin;  ///< (joint, weight) of all vertices
  const int* skin_begin;               ///< of a vertex
  const double* rotation;              ///< G_j^R row-major: 9 rows a joint
  const double* offset;                ///< A_j^t + trans: 3 rows a joint
};

inline constexpr long kFrameQuantum = 16;
inline constexpr int kTileVertices = 64;  ///< at most; their numbers stay in the cache

/// Vertices [begin, end) in all frames: v_p and v, 3 rows a vertex. `next` has, for every block,
/// the first of its vertices that is not below `begin`, and is moved on to `end`. What the blend
/// shapes add is summed in single precision, and fused where the instruction set has it: a
/// millionth of the millimeters that it is. `offsets` is scratch, 3 rows a vertex. All other sums
/// are double, in the same order for every instruction set, without fused multiply-adds.
using PoseTileLoop = void(const SkinningArguments& in, int begin, int end, long* next,
                          float* offsets, double* posed_rest, double* vertices);
PoseTileLoop PoseTileGeneric, PoseTileAvx2, PoseTileAvx512;

/// What derivatives by the vertices come to, rows as of what they belong to; sums over all
/// vertices.
struct SkinningGradient {
  double* rotation;
  double* offset;
  double* features;  ///< 9 rows a block
};

/// Vertices [begin, end) in all frames: from derivatives by v to those by v_p, 3 rows a vertex, and
/// adds to `sums`. `next` as above.
using AdjointTileLoop = void(const SkinningArguments& in, int begin, int end, long* next,
                             const double* posed_rest, const double* d_vertices,
                             double* d_posed_rest, const SkinningGradient& sums);
AdjointTileLoop AdjointTileGeneric, AdjointTileAvx2, AdjointTileAvx512;

}  // namespace holdfast::kernels
