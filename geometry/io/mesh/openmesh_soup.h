// SPDX-License-Identifier: MIT
#pragma once

// Private to geometry/io/mesh/mesh_io.cpp: the two ends of OpenMesh's input and output.

#include <cstdint>
#include <string>
#include <vector>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Takes what OpenMesh's readers find as polygons over vertices, without building a half-edge mesh:
/// that would refuse every face that makes the surface non-manifold.
class SoupImporter final : public OpenMesh::IO::BaseImporter {
 public:
  /// Positions are kept only when they are wanted; polygons and their corners are made room for.
  SoupImporter(bool wants_positions, std::size_t num_polygons, std::size_t num_corners)
      : wants_positions_(wants_positions) {
    polygon_begin.reserve(num_polygons + 1);
    polygon_ids.reserve(num_corners);
  }

  std::vector<Eigen::Vector3d> positions;
  std::vector<int> polygon_begin = {0};
  std::vector<int> polygon_ids;

  using VertexHandle = OpenMesh::VertexHandle;
  using HalfedgeHandle = OpenMesh::HalfedgeHandle;
  using EdgeHandle = OpenMesh::EdgeHandle;
  using FaceHandle = OpenMesh::FaceHandle;

  VertexHandle add_vertex(const OpenMesh::Vec3f& p) override {
    return add_vertex(OpenMesh::Vec3d(p));
  }
  VertexHandle add_vertex(const OpenMesh::Vec3d& p) override {
    if (wants_positions_) positions.emplace_back(p[0], p[1], p[2]);
    return VertexHandle(num_vertices_++);
  }
  VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3d(0.0)); }
  void set_point(VertexHandle vertex, const OpenMesh::Vec3f& p) override {
    if (wants_positions_) positions[vertex.idx()] << p[0], p[1], p[2];
  }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle corner : corners) polygon_ids.push_back(corner.idx());
    polygon_begin.push_back(static_cast<int>(polygon_ids.size()));
    return FaceHandle(static_cast<int>(polygon_begin.size()) - 2);
  }
  std::size_t n_vertices() const override { return static_cast<std::size_t>(num_vertices_); }
  std::size_t n_faces() const override { return polygon_begin.size() - 1; }
  std::size_t n_edges() const override { return 0; }

  // Nothing else in a file is asked for.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_color(EdgeHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec3f&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec4f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4f&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  bool wants_positions_;
  int num_vertices_ = 0;
};

/// Shows a TriangleMesh to OpenMesh's writers, manifold or not. The mesh must outlive it.
class SoupExporter final : public OpenMesh::IO::BaseExporter {
 public:
  explicit SoupExporter(const TriangleMesh& mesh) : mesh_(mesh) {}

  using VertexHandle = OpenMesh::VertexHandle;
  using HalfedgeHandle = OpenMesh::HalfedgeHandle;
  using EdgeHandle = OpenMesh::EdgeHandle;
  using FaceHandle = OpenMesh::FaceHandle;
  using StatusInfo = OpenMesh::Attributes::StatusInfo;

  OpenMesh::Vec3d pointd(VertexHandle v) const override {
    const auto p = mesh_.vertices.col(v.idx());
    return {p.x(), p.y(), p.z()};
  }
  OpenMesh::Vec3f point(VertexHandle v) const override { return OpenMesh::Vec3f(pointd(v)); }
  bool is_point_double() const override { return true; }
  unsigned int get_vhandles(FaceHandle f, std::vector<VertexHandle>& corners) const override {
    corners.clear();
    for (int k = 0; k < 3; ++k) corners.emplace_back(mesh_.faces(k, f.idx()));
    return 3;
  }
  OpenMesh::Vec3d normald(FaceHandle f) const override {
    const Eigen::Vector3d a = mesh_.vertices.col(mesh_.faces(0, f.idx()));
    const Eigen::Vector3d n = (mesh_.vertices.col(mesh_.faces(1, f.idx())) - a)
                                  .cross(mesh_.vertices.col(mesh_.faces(2, f.idx())) - a)
                                  .stableNormalized();
    return {n.x(), n.y(), n.z()};
  }
  OpenMesh::Vec3f normal(FaceHandle f) const override { return OpenMesh::Vec3f(normald(f)); }
  std::size_t n_vertices() const override { return mesh_.NumVertices(); }
  std::size_t n_faces() const override { return mesh_.NumFaces(); }
  std::size_t n_edges() const override { return 0; }
  bool is_triangle_mesh() const override { return true; }

  // A TriangleMesh has nothing else to show; has_...() all say so.
  bool is_normal_double() const override { return true; }
  OpenMesh::Vec3f normal(VertexHandle) const override { return OpenMesh::Vec3f(0.0f); }
  OpenMesh::Vec3d normald(VertexHandle) const override { return OpenMesh::Vec3d(0.0); }
  OpenMesh::Vec3uc color(VertexHandle) const override { return OpenMesh::Vec3uc(std::uint8_t{0}); }
  OpenMesh::Vec4uc colorA(VertexHandle) const override { return OpenMesh::Vec4uc(std::uint8_t{0}); }
  OpenMesh::Vec3ui colori(VertexHandle) const override { return OpenMesh::Vec3ui(0u); }
  OpenMesh::Vec4ui colorAi(VertexHandle) const override { return OpenMesh::Vec4ui(0u); }
  OpenMesh::Vec3f colorf(VertexHandle) const override { return OpenMesh::Vec3f(0.0f); }
  OpenMesh::Vec4f colorAf(VertexHandle) const override { return OpenMesh::Vec4f(0.0f); }
  OpenMesh::Vec2f texcoord(VertexHandle) const override { return OpenMesh::Vec2f(0.0f); }
  OpenMesh::Vec2f texcoord(HalfedgeHandle) const override { return OpenMesh::Vec2f(0.0f); }
  StatusInfo status(VertexHandle) const override { return {}; }
  HalfedgeHandle getHeh(FaceHandle, VertexHandle) const override { return HalfedgeHandle(); }
  unsigned int get_face_texcoords(std::vector<OpenMesh::Vec2f>&) const override { return 0; }
  OpenMesh::Vec3uc color(FaceHandle) const override { return OpenMesh::Vec3uc(std::uint8_t{0}); }
  OpenMesh::Vec4uc colorA(FaceHandle) const override { return OpenMesh::Vec4uc(std::uint8_t{0}); }
  OpenMesh::Vec3ui colori(FaceHandle) const override { return OpenMesh::Vec3ui(0u); }
  OpenMesh::Vec4ui colorAi(FaceHandle) const override { return OpenMesh::Vec4ui(0u); }
  OpenMesh::Vec3f colorf(FaceHandle) const override { return OpenMesh::Vec3f(0.0f); }
  OpenMesh::Vec4f colorAf(FaceHandle) const override { return OpenMesh::Vec4f(0.0f); }
  StatusInfo status(FaceHandle) const override { return {}; }
  OpenMesh::Vec3uc color(EdgeHandle) const override { return OpenMesh::Vec3uc(std::uint8_t{0}); }
  OpenMesh::Vec4uc colorA(EdgeHandle) const override { return OpenMesh::Vec4uc(std::uint8_t{0}); }
  OpenMesh::Vec3ui colori(EdgeHandle) const override { return OpenMesh::Vec3ui(0u); }
  OpenMesh::Vec4ui colorAi(EdgeHandle) const override { return OpenMesh::Vec4ui(0u); }
  OpenMesh::Vec3f colorf(EdgeHandle) const override { return OpenMesh::Vec3f(0.0f); }
  OpenMesh::Vec4f colorAf(EdgeHandle) const override { return OpenMesh::Vec4f(0.0f); }
  StatusInfo status(EdgeHandle) const override { return {}; }
  int get_halfedge_id(VertexHandle) override { return -1; }
  int get_halfedge_id(FaceHandle) override { return -1; }
  int get_next_halfedge_id(HalfedgeHandle) override { return -1; }
  int get_to_vertex_id(HalfedgeHandle) override { return -1; }
  int get_face_id(HalfedgeHandle) override { return -1; }
  StatusInfo status(HalfedgeHandle) const override { return {}; }

  // The .ply writer looks for custom properties here without asking whether there is a kernel.
  const OpenMesh::BaseKernel* kernel() override { return &no_properties_; }

 private:
  const TriangleMesh& mesh_;
  OpenMesh::BaseKernel no_properties_;
};

}  // namespace holdfast
