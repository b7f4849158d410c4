// SPDX-License-Identifier: MIT
#pragma once

/// Containers of data: files or bytes come in; arrays, values, JSON and words of texts come out,
/// and the same way back. Nothing in a file is executed, and sizes are checked before memory is
/// taken.
///
/// From the inside out:
///   byte_source.h                   bytes of an open file or memory
///   atomic_file.h                   files written atomically; ReadFile
///   checksum.h                      FNV-1a of bytes
///   gzip.h                          gzip'd files up to a limit
///   zip_archive.h                   members of zip archives
///   half.h                          half precision to single and back
///   npz.h                           .npy and .npz, read and written
///   npy_header.h                    the header of one .npy member
///   safetensors.h                   named tensors with texts
///   data_value.h                    one value of a file, any format
///   data_store.h                    all values of a file, by index
///   object_fields.h                 instances of classes, their fields
///   sparse_value.h, chumpy_value.h  scipy.sparse and chumpy as arrays
///   json_budget.h                   JSON parsed within a memory budget
///   json_text.h                     JSON as UTF-8 text, whatever bytes its texts are
///   read_json.h                     JSON files, missing ones too
///   wall_times.h                    results and their wall times, apart
///   text_scanner.h                  words of a text with line numbers
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/data_value.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/io/container/text_scanner.h"
