// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/io/container/data_value.h"
#include "geometry/io/container/zip_archive.h"

namespace holdfast {

/// Whether a zip archive is what torch.save has written since torch 1.6: a top folder of any name
/// with a pickle `data.pkl` and the numbers as `data/<key>`.
bool IsTorchArchive(const ZipArchive& archive);

/// The value in it. Tensors become arrays; those that share a storage share its bytes, which are
/// read once. Storages of another byte order are turned. Throws Error for TorchScript programs
/// (they are code), for classes that are no plain data, and for tensors that reach outside their
/// storage.
DataValue ReadTorchArchive(const ZipArchive& archive);

}  // namespace holdfast
