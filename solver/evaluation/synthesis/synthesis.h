// SPDX-License-Identifier: MIT
#pragma once

/// IMoS's Table 2. Held-out sequences, networks and an action classifier go in; samples measured in
/// blocks of files, and a summary per row, come out.
///
/// From the inside out:
///   synthesis_case.h     a held-out sequence; motions generated for it
///   synthesis_rows.h     rows of our table and the paper's
///   synthesis_results.h  samples summarized, as JSON
///   synthesis_study.h    SynthesisStudy: all rows, resumable
#include "solver/evaluation/synthesis/synthesis_results.h"
#include "solver/evaluation/synthesis/synthesis_study.h"
