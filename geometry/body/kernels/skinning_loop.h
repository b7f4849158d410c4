// SPDX-License-Identifier: MIT
// Included by one file per instruction set, which defines HOLDFAST_LANES (doubles per vector),
// HOLDFAST_MULTIPLY_ADD(a, b, c) (a b + c for a float a and vectors b, c of twice as many floats),
// and the names of the loops, HOLDFAST_POSE_TILE and HOLDFAST_ADJOINT_TILE.
#pragma once

#include "geometry/body/kernels/skinning_arguments.h"

namespace holdfast::kernels {
namespace {

using Lanes [[gnu::vector_size(8 * HOLDFAST_LANES), gnu::aligned(8), gnu::may_alias]] = double;

using FloatLanes [[gnu::vector_size(8 * HOLDFAST_LANES), gnu::aligned(4), gnu::may_alias]] = float;

inline const FloatLanes& At(const float* p) { return *reinterpret_cast<const FloatLanes*>(p); }
inline FloatLanes& At(float* p) { return *reinterpret_cast<FloatLanes*>(p); }
inline const Lanes& At(const double* p) { return *reinterpret_cast<const Lanes*>(p); }
inline Lanes& At(double* p) { return *reinterpret_cast<Lanes*>(p); }

// Advances to the block's first vertex that is not below `end`.
void PassTile(const SkinningArguments::Block& block, int end, long& next) {
  while (next < block.count && block.vertices[next] < end) ++next;
}

void AddPoseDirs(const SkinningArguments& in, const SkinningArguments::Block& block, int begin,
                 long first, long last, float* offsets) {
  float dirs[27 * kTileVertices];
  for (long e = 27 * first; e < 27 * last; ++e) {
    dirs[e - 27 * first] = static_cast<float>(block.dirs[e]);
  }
  for (long f = 0; f < in.frames; f += 2 * HOLDFAST_LANES) {
    FloatLanes x[9];
    for (int e = 0; e < 9; ++e) x[e] = At(block.feature + e * in.frames + f);
    for (long k = first; k < last; ++k) {
      float* const out = offsets + 3 * (block.vertices[k] - begin) * in.frames + f;
      const float* const d = dirs + 27 * (k - first);
      FloatLanes sum[3] = {At(out), At(out + in.frames), At(out + 2 * in.frames)};
      for (int e = 0; e < 9; ++e) {
        for (int c = 0; c < 3; ++c) sum[c] = HOLDFAST_MULTIPLY_ADD(d[9 * c + e], x[e], sum[c]);
      }
      for (int c = 0; c < 3; ++c) At(out + c * in.frames) = sum[c];
    }
  }
}

void Skin(const SkinningArguments& in, int vertex, const double* posed_rest, double* out) {
  const long n = in.frames;
  for (long f = 0; f < n; f += HOLDFAST_LANES) {
    const Lanes p[3] = {At(posed_rest + f), At(posed_rest + n + f), At(posed_rest + 2 * n + f)};
    Lanes sum[3] = {};
    for (int k = in.skin_begin[vertex]; k < in.skin_begin[vertex + 1]; ++k) {
      const auto& [joint, weight] = in.skin[k];
      const double* const R = in.rotation + 9 * joint * n + f;
      const double* const t = in.offset + 3 * joint * n + f;
      for (int c = 0; c < 3; ++c) {
        const double* const row = R + 3 * c * n;
        const Lanes x = At(row) * p[0], y = At(row + n) * p[1], z = At(row + 2 * n) * p[2];
        const Lanes turned = c < 2 ? (x + y) + z : x + (y + z);  // Eigen's order: two rows at once
        sum[c] += weight * (turned + At(t + c * n));
      }
    }
    for (int c = 0; c < 3; ++c) At(out + c * n + f) = sum[c];
  }
}

void SkinAdjoint(const SkinningArguments& in, int vertex, const double* posed_rest,
                 const double* d_vertex, double* out, const SkinningGradient& sums) {
  const long n = in.frames;
  for (long f = 0; f < n; f += HOLDFAST_LANES) {
    Lanes d_posed[3] = {};
    for (int k = in.skin_begin[vertex]; k < in.skin_begin[vertex + 1]; ++k) {
      const auto& [joint, weight] = in.skin[k];
      const double* const R = in.rotation + 9 * joint * n + f;
      double* const d_R = sums.rotation + 9 * joint * n + f;
      Lanes share[3];
      for (int c = 0; c < 3; ++c) {
        share[c] = weight * At(d_vertex + c * n + f);
        At(sums.offset + (3 * joint + c) * n + f) += share[c];
        for (int e = 0; e < 3; ++e)
          At(d_R + (3 * c + e) * n) += share[c] * At(posed_rest + e * n + f);
      }
      for (int c = 0; c < 3; ++c) {
        const double* const column = R + c * n;
        d_posed[c] +=
            (At(column) * share[0] + At(column + 3 * n) * share[1]) + At(column + 6 * n) * share[2];
      }
    }
    for (int c = 0; c < 3; ++c) At(out + c * n + f) = d_posed[c];
  }
}

void PoseDirsAdjoint(const SkinningArguments& in, const SkinningArguments::Block& block, int begin,
                     long first, long last, const double* d_posed_rest, double* d_features) {
  for (long f = 0; f < in.frames; f += HOLDFAST_LANES) {
    Lanes sum[9];
    for (int e = 0; e < 9; ++e) sum[e] = At(d_features + e * in.frames + f);
    for (long k = first; k < last; ++k) {
      const double* const at = d_posed_rest + 3 * (block.vertices[k] - begin) * in.frames + f;
      const Lanes d[3] = {At(at), At(at + in.frames), At(at + 2 * in.frames)};
      const double* const dirs = block.dirs + 27 * k;
      for (int e = 0; e < 9; ++e) {
        const Lanes x = dirs[e] * d[0], y = dirs[9 + e] * d[1], z = dirs[18 + e] * d[2];
        sum[e] += e < 8 ? (x + y) + z : x + (y + z);  // in Eigen's order: two rows at once
      }
    }
    for (int e = 0; e < 9; ++e) At(d_features + e * in.frames + f) = sum[e];
  }
}

}  // namespace

void HOLDFAST_POSE_TILE(const SkinningArguments& in, int begin, int end, long* next, float* offsets,
                        double* posed_rest, double* vertices) {
  const long numbers = 3 * (end - begin) * in.frames;
  for (long k = 0; k < numbers; ++k) offsets[k] = 0.0f;
  for (int b = 0; b < in.num_blocks; ++b) {
    const long first = next[b];
    PassTile(in.blocks[b], end, next[b]);
    if (in.blocks[b].feature != nullptr) {
      AddPoseDirs(in, in.blocks[b], begin, first, next[b], offsets);
    }
  }
  for (int r = 3 * begin; r < 3 * end; ++r) {
    const long row = (r - 3 * begin) * in.frames;
    for (long f = 0; f < in.frames; ++f) {
      posed_rest[row + f] = in.rest[r] + static_cast<double>(offsets[row + f]);
    }
  }
  for (int i = begin; i < end; ++i) {
    const long at = 3 * (i - begin) * in.frames;
    Skin(in, i, posed_rest + at, vertices + at);
  }
}

void HOLDFAST_ADJOINT_TILE(const SkinningArguments& in, int begin, int end, long* next,
                           const double* posed_rest, const double* d_vertices, double* d_posed_rest,
                           const SkinningGradient& sums) {
  for (int i = begin; i < end; ++i) {
    const long at = 3 * (i - begin) * in.frames;
    SkinAdjoint(in, i, posed_rest + at, d_vertices + at, d_posed_rest + at, sums);
  }
  for (int b = 0; b < in.num_blocks; ++b) {
    const long first = next[b];
    PassTile(in.blocks[b], end, next[b]);
    PoseDirsAdjoint(in, in.blocks[b], begin, first, next[b], d_posed_rest,
                    sums.features + 9 * b * in.frames);
  }
}

}  // namespace holdfast::kernels
