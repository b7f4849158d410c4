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
    const double* dirs;     ///< 3 x 9 a vertex, row-major
    const double* feature;  ///< R - I, row-major: 9 rows
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

inline constexpr long kFrameQuantum = 8;

/// Vertices [begin, end) in all frames: v_p and v, 3 rows a vertex. `next` has, for every block,
/// the first of its vertices that is not below `begin`, and is moved on to `end`. Sums are made in
/// the same order for every instruction set, without fused multiply-adds.
using PoseTileLoop = void(const SkinningArguments& in, int begin, int end, long* next,
                          double* posed_rest, double* vertices);
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
