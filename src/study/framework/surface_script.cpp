#include "surface_script.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include <Eigen/Geometry>

#include "slender_sim/geometry/mesh_offsets.h"

namespace slender::study {

using Eigen::Vector3d;

namespace {

/// A triangle on the page, and the brightness of its corners (a grey one's lies between 2 and 3, of hue k between 4 + 2
/// k and 5 + 2 k).
struct Facet
{
  Eigen::Vector2d corner[3];
  double shade[3], depth;
};

std::vector<Facet> facetsOf(const SurfacePicture::Panel& panel, const SurfacePicture& picture)
{
  const Vector3d view = picture.view.normalized(), right = view.cross(picture.up).normalized(), up = right.cross(view);
  const Vector3d light = (-0.5 * right + 0.6 * up - view).normalized();
  std::vector<Facet> facets;
  for (const SurfacePicture::Surface& surface : panel.surfaces)
  {
    const TriangleMesh& mesh = surface.mesh;
    const Eigen::Matrix3Xd normals = vertexNormals(mesh);
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    {
      Facet facet{};
      const double shift = surface.hues.size() > 0 ? 4.0 + 2.0 * surface.hues[f] : surface.cloth ? 0.0 : 2.0;
      for (int k = 0; k < 3; ++k)
      {
        const Vector3d x = mesh.vertices.col(mesh.triangles(k, f));
        Vector3d normal = normals.col(mesh.triangles(k, f));
        if (normal.dot(view) > 0)   // the side that is seen
          normal = -normal;
        facet.corner[k] = {right.dot(x), up.dot(x)};
        facet.shade[k] = 0.15 + 0.85 * std::max(0.0, normal.dot(light)) + shift;
        facet.depth += view.dot(x) / 3.0;
      }
      facets.push_back(facet);
    }
  }
  // far ones first
  std::stable_sort(facets.begin(), facets.end(), [](const Facet& a, const Facet& b) { return a.depth > b.depth; });
  return facets;
}

bool hasHues(const SurfacePicture& picture)
{
  for (const SurfacePicture::Panel& panel : picture.panels)
    for (const SurfacePicture::Surface& surface : panel.surfaces)
      if (surface.hues.size() > 0)
        return true;
  return false;
}

}   // namespace

std::string gnuplotString(const std::string& text)
{
  std::string out = "\"";
  for (const char c : text)
    out += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

void writeSurfaceScript(std::ostream& out, const SurfacePicture& picture, const std::string& png)
{
  std::vector<std::vector<Facet>> panels;
  Eigen::AlignedBox2d box;
  for (const SurfacePicture::Panel& panel : picture.panels)
  {
    panels.push_back(facetsOf(panel, picture));
    for (const Facet& facet : panels.back())
      for (const Eigen::Vector2d& corner : facet.corner)
        box.extend(corner);
  }
  const int columns = std::min<int>(picture.columns, static_cast<int>(panels.size()));
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  // with room for labels
  const double width = 1.08 * box.sizes().x(), height = 1.05 * box.sizes().y() + 0.1 * box.sizes().x();
  const double pixels = std::min(1500.0 / (columns * width), 1800.0 / (rows * height));
  char line[160];
  std::snprintf(line, sizeof line, "set terminal pngcairo size %.0f,%.0f noenhanced font \"sans,14\"\n",
                columns * width * pixels, rows * height * pixels + 60);
  out << line << "set output " << gnuplotString(png) << "\nset title " << gnuplotString(picture.title)
      << " offset 0,-0.3\n"
      << "unset key\nunset tics\nunset border\nunset colorbox\nset lmargin at screen 0\nset rmargin at screen 1\n"
      << "set bmargin at screen 0\nset tmargin at screen " << 1.0 - 60.0 / (rows * height * pixels + 60)
      << "\nset view map\nset pm3d explicit scansforward corners2color mean border retrace\n"
      << "set palette defined (0 \"#20120c\", 1 \"#f4c9a0\", 2 \"#101418\", 3 \"#b4bcc8\"";
  int last = 3;
  if (hasHues(picture))
    for (const char* light : {"#f28e7c", "#8ec6f0", "#b6dd8a", "#f5d76e", "#c9a5e6", "#f4b3cf", "#8fdccb"})
    {
      out << ", " << last + 1 << " \"#1c1c1c\", " << last + 2 << " \"" << light << "\"";
      last += 2;
    }
  out << ")\nset cbrange [0:" << last << "]\n";
  std::snprintf(line, sizeof line, "set xrange [0:%.6g]\nset yrange [0:%.6g]\n", columns * width, rows * height);
  out << line;
  for (std::size_t p = 0; p < panels.size(); ++p)
  {
    const double x = (static_cast<double>(p % columns) + 0.5) * width,
                 y = (rows - 1 - static_cast<double>(p / columns)) * height;
    std::snprintf(line, sizeof line, " at %.6g,%.6g,0 center front\n", x, y + 0.04 * width);
    out << "set label " << gnuplotString(picture.panels[p].label) << line;
  }
  out << "$facets << EOD\n";
  for (std::size_t p = 0; p < panels.size(); ++p)
  {
    const Eigen::Vector2d shift(static_cast<double>(p % columns) * width - box.center().x() + 0.5 * width,
                                (rows - 1 - static_cast<double>(p / columns)) * height - box.min().y() + 0.09 * width);
    for (const Facet& facet : panels[p])   // a quadrilateral of two rows, with two equal corners
    {
      for (const int k : {0, 1, 2, 2})
      {
        const Eigen::Vector2d at = facet.corner[k] + shift;
        std::snprintf(line, sizeof line, "%.5g %.5g 0 %.3f\n%s", at.x(), at.y(), facet.shade[k], k == 1 ? "\n" : "");
        out << line;
      }
      out << "\n\n";
    }
  }
  out << "EOD\nsplot $facets using 1:2:3:4 with pm3d\n";
}

}   // namespace slender::study
