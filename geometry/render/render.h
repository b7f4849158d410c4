// SPDX-License-Identifier: MIT
#pragma once

/// Pictures on the CPU: meshes or a clip, a camera and options come in; images, PNG files and
/// videos come out, the same bytes for the same scene.
///
/// From the inside out:
///   image.h           an 8-bit sRGB picture
///   camera.h          pinhole camera, orbits and close-ups
///   triangle_scan.h   samples of a grid inside a triangle
///   visibility.h      z-buffer of triangle ids
///   shadow_map.h      shadows of meshes on each other
///   ground_shadow.h   shadows on a horizontal plane
///   lighting.h        linear light, three lights and sky
///   rasterizer.h      Render: meshes to an image
///   clip_renderer.h   frames of a clip, contact colored
///   label.h           a line of text in a picture
///   contact_sheet.h   labeled pictures in rows
///   png.h             PNG encoded, decoded, written
///   ffmpeg_process.h  the program ffmpeg, through a pipe
///   video.h           frames as .mp4 or .gif
///   clip_pictures.h   pictures of a clip, a sheet or a video of them, written
#include "geometry/render/clip_pictures.h"
#include "geometry/render/clip_renderer.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/png.h"
#include "geometry/render/rasterizer.h"
#include "geometry/render/video.h"
