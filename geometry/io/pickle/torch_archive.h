// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "geometry/io/container/data_store.h"
#include "geometry/io/container/data_value.h"
#include "geometry/io/container/zip_archive.h"

namespace holdfast {

/// Whether a zip archive is in the format of torch.save since torch 1.6: a top folder of any name
/// with a pickle `data.pkl` and the numbers as `data/<key>`.
bool IsTorchArchive(const ZipArchive& archive);

/// Returns the value in it. Tensors become arrays; those that share a storage share its bytes,
/// which are read once. Storages of another byte order are byte-swapped. Throws Error for
/// TorchScript programs (they are code), for classes that are not plain data, and for tensors that
/// extend beyond their storage.
DataValue ReadTorchArchive(const ZipArchive& archive);

/// Whether bytes begin as torch.save wrote before torch 1.6, and still does with
/// `_use_new_zipfile_serialization=False`: with the pickle of a magic number.
bool LooksLikeTorchLegacy(std::span<const std::byte> head);

/// Returns the value in such a file: pickles of the magic number, the protocol, the writer's
/// machine, the object, and the names of its storages, then each storage as its length and its
/// numbers. Arrays are views into `file`. Throws Error as ReadTorchArchive does.
DataValue ReadTorchLegacy(DataBytes file, const std::string& where);

/// Returns the numbers of the only storage of such a file inside a pickle, the form of pickled
/// tensors; sets `element` to their type.
DataBytes ReadNestedTorchStorage(std::span<const std::byte> file, const std::string& where,
                                 ElementType& element);

}  // namespace holdfast
