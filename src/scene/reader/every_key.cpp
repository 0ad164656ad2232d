#include "scene_text.h"

namespace slender {

const std::vector<std::string>& everyKeyScenes()
{
  static const std::vector<std::string> scenes = {R"(
start: {equilibrium: true}
statics: {path: {steps: 2}, buckling: {up_to: 2}, factors: [1]}
record: {fields: [energy], nodes: {a: [0]}}
limits: {strain: 1}
rods:
  - {name: a, closed: false, centerline: {straight: {}}, initial: {arc: {}}, cross_section: {ellipse: [0.01, 0.02]},
     rest_twist: 1, natural_curvature: [1, 0], material: {bend_modulus: 1},
     loads: [{at: 0.5, force: [0, 0, 1], torque: 1}, {node: 1, force: [0, 0, 1]}], contact: {},
     grasps: {g: {edges: [0], contact: {}, motion: {table: [[0, 0, 0, 0]]}, limits: {force: 1}}, h: {nodes: [-1], offset: {}, motion: {topic: true}},
              i: {nodes: [3], motion: {body: c}}, j: {nodes: [5], motion: {file: none.csv, body: c}},
              k: {nodes: [7], motion: fixed}, l: {nodes: [9], motion: {tf: tool0, offset: {}}}}}
  - {name: b, centerline: {polyline: {points: [[0, 0, 0], [1, 0, 0]], edges: 4}}}
  - {name: c, broadcast_tf: {tip: -1}, centerline: {helix: {}}, cross_section: {radius: 0.01}}
  - {name: d, centerline: {catenary: {}}}
  - {name: e, centerline: {trefoil: {}}}
  - {name: f, centerline: {torus_knot: {}}}
  - {name: g, centerline: {vee: {}}}
  - {name: h, centerline: {file: {path: none.csv}}}
  - {name: i, track: {guide: {nodes: 3, motion: {table: [[0, 0, 0, 0, 1, 0, 0, 2, 0, 0]]}}, test_functions: {basis: hats}}}
  - {name: j, track: {guide: {points: [[0, 0, 0], [1, 0, 0]], motion: {file: none.csv}}, test_functions: {segments: 2}}}
  - {name: k, track: {guide: {points: [[0, 0, 0], [1, 0, 0]], motion: {topic: points, late: {extrapolate: 1}}}}}
  - {name: l, track: {guide: {points: [[0, 0, 0], [1, 0, 0]], motion: fixed}}}
  - {name: m, track: {guide: {file: none.csv}}}
  - {name: n, track: {guide: {points: [[0, 0, 0], [1, 0, 0]], motion: {tf: link, offset: {}}}}}
threads:
  - {name: t, fluid: {}, nozzle: {flow: {table: [[0, 0], [1, 1]]}, motion: fixed},
     floor: {belt: {x: {table: [[0, 0]]}, y: {table: [[0, 0]]}, topic: true}}, contact: {}, merging: {until: 0.6},
     edges: {}, region: {}}
  - {name: u, nozzle: {flow: {topic: true, initial: 1}}, floor: {belt: {x: {topic: true, initial: 1}, y: {topic: true, initial: 1}}}}
  - {name: v, nozzle: {flow: 1}, floor: {belt: {x: 0, y: 0}}, merging: true}
  - {name: w, centerline: {straight: {}}, radius: 0.01, ends: {}, floor: {belt: [0, 0]}}
cloths:
  - {name: k, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, bending: {model: hinge},
     plasticity: {yield_curvature: 1}, membrane: {}, undeformed: {folds: {}}, contact: {}, aerodynamics: {}, damping: {},
     solver: {}, start: {file: none.obj},
     grasps: {g: {vertices: [0], offset: {}, motion: {topic: true}, limits: {force: 1}}, h: {near: {point: [0, 0, 0]}, motion: fixed}, i: {edge: left}, j: {corner: upper_left}},
     loads: [{vertices: [0], force: [0, 0, 1]}, {near: {point: [0, 0, 0]}, force: [0, 0, 1]}, {edge: left}, {corner: upper_left}]}
  - {name: l, mesh: {file: none.obj}, undeformed: {ridges: {}}}
  - {name: m, mesh: {file: none.obj}, undeformed: {crinkles: {}}}
  - {name: n, mesh: {file: none.obj}, undeformed: {file: none.obj}}
tracked:
  - {name: o, guide: {cloth: k}}
  - {name: p, guide: {mesh: {file: none.obj}, motion: {topic: points, late: {extrapolate: 1}}}, mesh: {subdivide: 1}, max_traction: 50}
  - {name: q, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: {bodies: none.csv, groups: {a: [0..-1]}}}, mesh: {file: none.obj}, membrane: {}}
  - {name: r, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: {frames: none_*.obj, rate: 1}}, mesh: same, max_traction: {r: 50}}
  - {name: s, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: {bag: {file: none.bag}}}, mesh: same}
  - {name: t, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: {bag: none.bag, groups: obj}}, mesh: same}
  - {name: u, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: fixed}, mesh: same,
     test_functions: [{name: a, basis: subdivision, vertices: [0]}, {name: b, regions: {a: {guide: [0], tracked: [0]}}},
                      {name: c, regions: obj}, {name: d, clusters: {}}]}
  - {name: v, guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 1}, motion: {tf: link, offset: {}}}, mesh: same}
bodies:
  - {name: b, pose: {}, motion: free, velocity: {}, damping: {}, welds: [{rod: a, edge: 1}]}
obstacles:
  - {name: o, shape: {plane: {normal: [0, 0, 1]}}, motion: {table: [[0, 0, 0, 0]]}}
  - {name: p, pose: {orientation: [0, 0, 0, 1]}, shape: {sphere: {}}, motion: {file: none.csv, body: x}}
  - {name: q, shape: {box: {}}, motion: {topic: true}}
  - {name: r, shape: {cylinder: {}}, motion: {tf: link, offset: {}}}
  - {name: s, shape: {capsule: {}}}
  - {name: t, shape: {mesh: {file: none.obj}}}
robot: {description: none.urdf, ignore: [l], joints: {j: 0}, pose: {}}
generate:
  - chain: {start_motion: fixed, end_motion: fixed}
  - tree: {motion: fixed}
  - hair: {head: {motion: fixed}}
)",
                                                  R"(
start: equilibrium
statics: {buckling: true}
bodies: [{mass: 1}]
)"};
  return scenes;
}

}   // namespace slender
