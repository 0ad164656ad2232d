#include <stdexcept>

#include "slender_sim/geometry/mesh_file.h"

#ifdef SLENDER_WITH_ASSIMP
#include <functional>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#endif

namespace slender {

#ifdef SLENDER_WITH_ASSIMP

TriangleMesh readCollada(const std::string& path)
{
  Assimp::Importer importer;
  // The file may give another up axis. Meshes of robots are used without a rotation to this axis, as in rviz.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_MATERIALS | aiComponent_TEXTURES);
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_RemoveComponent |
                                                     aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  if (!scene)
    throw std::runtime_error(path + ": " + importer.GetErrorString());
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  const std::function<void(const aiNode&, const aiMatrix4x4&)> add = [&](const aiNode& node,
                                                                         const aiMatrix4x4& parent) {
    const aiMatrix4x4 transform = parent * node.mTransformation;
    for (unsigned m = 0; m < node.mNumMeshes; ++m)
    {
      const aiMesh& mesh = *scene->mMeshes[node.mMeshes[m]];
      const int first = static_cast<int>(vertices.size());
      for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      {
        const aiVector3D p = transform * mesh.mVertices[v];
        vertices.emplace_back(p.x, p.y, p.z);
      }
      for (unsigned f = 0; f < mesh.mNumFaces; ++f)
        if (mesh.mFaces[f].mNumIndices == 3)
        {
          const unsigned* corner = mesh.mFaces[f].mIndices;
          triangles.emplace_back(first + static_cast<int>(corner[0]), first + static_cast<int>(corner[1]),
                                 first + static_cast<int>(corner[2]));
        }
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c)
      add(*node.mChildren[c], transform);
  };
  add(*scene->mRootNode, aiMatrix4x4());
  if (triangles.empty())
    throw std::runtime_error(path + ": has no triangles");
  return triangleMesh(vertices, triangles);
}

#else

TriangleMesh readCollada(const std::string& path)
{
  throw std::runtime_error(
      path +
      ": this build reads no DAE files; install libassimp-dev (scripts/setup does) and build anew, "
      "or convert the file to STL or OBJ");
}

#endif

}   // namespace slender
