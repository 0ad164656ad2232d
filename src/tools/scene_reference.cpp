// Writes the reference of scene files, as the reader itself asks for their keys.
#include <exception>
#include <iostream>

#include "slender_sim/scene/scene_reference.h"

int main(int argc, char** argv)
try
{
  const char* const usage =
      "usage: scene_reference SCENE.yaml...\nwrites, in Markdown, every key that is asked for as these scenes are "
      "read\n";
  if (argc == 2 && (std::string(argv[1]) == "--help" || std::string(argv[1]) == "-h"))
  {
    std::cout << usage;
    return 0;
  }
  if (argc < 2 || std::string(argv[1]).rfind("--", 0) == 0)
  {
    std::cerr << usage;
    return 2;
  }
  std::cout << slender::sceneReference(slender::sceneKeys({argv + 1, argv + argc}));
  return 0;
}
catch (const std::exception& e)
{
  std::cerr << e.what() << std::endl;
  return 2;
}
