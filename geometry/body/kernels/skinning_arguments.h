// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

namespace holdfast::kernels {

/// One person in several frames, side by side: each scalar of a frame is stored in a row of
/// `frames` doubles, a multiple of kFrameQuantum.
struct SkinningArguments {
  /// Pose blend shapes of a joint, as in BodySurface::PoseDirBlock.
  struct Block {
    const int* vertices;  ///< ascending
    long count;
    const double* dirs;    ///< 3 x 9 per vertex, row-major
    const float* feature;  ///< R - I, row-major: 9 rows; null if zero in all frames
  };

  long frames;
  const Block* blocks;
  int num_blocks;
  const double* rest;                  ///< v_s, 3 per vertex
  const std::pair<int, double>* skin;  ///< (joint, weight) of all vertices
  const int* skin_begin;               ///< start of each vertex's pairs
  const double* rotation;              ///< G_j^R row-major: 9 rows per joint
  const double* offset;                ///< A_j^t + trans: 3 rows per joint
};

inline constexpr long kFrameQuantum = 16;
inline constexpr int kTileVertices = 64;  ///< maximum; a tile's data fits in the cache

/// Computes v_p and v of the vertices [begin, end) in all frames, 3 rows per vertex. `next` holds,
/// for every block, its first vertex that is not below `begin`, and is advanced to `end`. The
/// millimeter offsets of the blend shapes are summed in single precision (relative error about
/// 1e-6), with fused multiply-adds if available. `offsets` is scratch, 3 rows per vertex. All other
/// sums are double, in the same order for every instruction set, without fused multiply-adds.
using PoseTileLoop = void(const SkinningArguments& in, int begin, int end, long* next,
                          float* offsets, double* posed_rest, double* vertices);
PoseTileLoop PoseTileGeneric, PoseTileAvx2, PoseTileAvx512;

/// Accumulated derivatives, in the row layout of the inputs; sums over all vertices.
struct SkinningGradient {
  double* rotation;
  double* offset;
  double* features;  ///< 9 rows per block
};

/// For the vertices [begin, end) in all frames, maps derivatives with respect to v to those with
/// respect to v_p, 3 rows per vertex, and adds to `sums`. `next` as above.
using AdjointTileLoop = void(const SkinningArguments& in, int begin, int end, long* next,
                             const double* posed_rest, const double* d_vertices,
                             double* d_posed_rest, const SkinningGradient& sums);
AdjointTileLoop AdjointTileGeneric, AdjointTileAvx2, AdjointTileAvx512;

}  // namespace holdfast::kernels
