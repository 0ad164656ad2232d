// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "pack.h"
#include "slender_sim/energy/compensated_response.h"
#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/flush_denormals.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

void copyEdge(const RodArrays& r, int to, int from)
{
  for (int k = 0; k < 3; ++k)
  {
    r.t[k][to] = r.t[k][from];
    r.d1[k][to] = r.d1[k][from];
  }
  r.inverse_length[to] = r.inverse_length[from];
  r.strain[to] = r.strain[from];
}

/// Tangents, lengths and frames of edges from .. to-1 (rounded up to whole packs).
void evaluateEdges(const RodArrays& r, int from, int to, Pack& min_chi)
{
  for (int j = from; j < to; j += W)
  {
    const Vec3<Pack> e = load3(r.x, j + 1) - load3(r.x, j);
    const Pack length = squareRoot(dot(e, e));
    const Pack inverse = 1.0 / length;
    const Vec3<Pack> t = e * inverse;
    // transport in time (3.17) written out for a vector normal to the old tangent, cleaned of round-off, then the turn
    const Vec3<Pack> t0 = load3(r.base_t, j), d0 = load3(r.base_d1, j);
    const Pack chi = 1.0 + dot(t0, t);
    min_chi = minimum(chi, min_chi);
    Vec3<Pack> d = d0 - (t0 + t) * (dot(d0, t) / chi);
    d = d - t * dot(d, t);
    d = d * (1.0 / squareRoot(dot(d, d)));
    Pack s, c;
    sineCosine(load(r.turn + j), s, c);
    d = d * c + cross(t, d) * s;
    store3(r.t, j, t);
    store3(r.d1, j, d);
    store(r.inverse_length + j, inverse);
    store(r.strain + j, length * load(r.inverse_rest_length + j) - 1.0);
  }
}

/// Twist of a pack of joints: the angle from the transported frame to the next one, unwrapped next to where the turns
/// would take it. Measured from the frames each time, so it never drifts however many turns it counts.
SLENDER_INLINE Pack jointTwist(const RodArrays& r, int i, const JointFrames<Pack>& s)
{
  const Pack chi = 1.0 + dot(s.te, s.tf);
  const Vec3<Pack> p = s.d1e - (s.te + s.tf) * (dot(s.d1e, s.tf) / chi);
  const Pack angle = angleOf(dot(cross(s.tf, p), s.d1f), dot(p, s.d1f));
  const Pack expected = load(r.base_twist + i) + load(r.turn + i) - load(r.turn + i - 1);
  return angle + kTwoPi * nearest((expected - angle) * (1.0 / kTwoPi));
}

/// The joints of a RodSweep by name, ten used of each sixteen: two carried over, eight new. Slot k is joint (next_joint
/// - 2 + k).
struct JointBuffer
{
  double ee[6][16], ff[6][16], ef[3][3][16], e_te[3][16], e_tf[3][16], f_te[3][16], f_tf[3][16];
  double te_te[16], te_tf[16], tf_tf[16];
  double ge[3][16], gf[3][16], gte[16], gtf[16];
  double stretch[16], bend_twist[16];
};
static_assert(sizeof(JointBuffer) == sizeof(RodSweep::joints), "RodSweep::kQuantities");

SLENDER_INLINE void storeSym(double (*b)[16], const Sym3<Pack>& s)
{
  store(b[0] + 2, s.xx);
  store(b[1] + 2, s.xy);
  store(b[2] + 2, s.xz);
  store(b[3] + 2, s.yy);
  store(b[4] + 2, s.yz);
  store(b[5] + 2, s.zz);
}
SLENDER_INLINE void storeVec(double (*b)[16], const Vec3<Pack>& v)
{
  store(b[0] + 2, v.x);
  store(b[1] + 2, v.y);
  store(b[2] + 2, v.z);
}

/// Response of joints i .. i+W-1 and the strains it compares with the rest strains.
template <Curvature kind>
SLENDER_INLINE JointResponse<Pack> respond(const RodArrays& r, int i, const JointStrains<Pack>& k, Pack twist)
{
  const JointMaterial<Pack> p = {load(r.b11 + i),       load(r.b12 + i),         load(r.b22 + i),
                                 load(r.beta + i),      load(r.rest_kappa1 + i), load(r.rest_kappa2 + i),
                                 load(r.rest_twist + i)};
  if constexpr (kind == Curvature::compensated)
  {
    JointCompensation<Pack> a;
    a.coupling = load(r.coupling + i);
    a.half_turn_cosine = squareRoot(0.5 * (1.0 / k.inverse_chi));
    sineCosine(0.5 * twist - kTwoPi * nearest(twist * (0.5 / kTwoPi)), a.half_twist_sine, a.half_twist_cosine);
    Pack kappa1, kappa2;
    const JointResponse<Pack> response = compensatedResponse(k, twist, p, a, kappa1, kappa2);
    store(r.kappa1 + i, kappa1);
    store(r.kappa2 + i, kappa2);
    return response;
  }
  store(r.kappa1 + i, k.kappa1);
  store(r.kappa2 + i, k.kappa2);
  return tangentResponse(k, twist, p);
}

template <bool WithHessian, Curvature kind>
SLENDER_INLINE void evaluateJoints(const RodArrays& r, int i, JointBuffer& buffer, Pack& min_chi)
{
  // last two joints of the previous round
  double* all = &buffer.ee[0][0];
  for (unsigned k = 0; k < sizeof(JointBuffer) / sizeof(double) / 16; ++k)
  {
    all[16 * k] = all[16 * k + 8];
    all[16 * k + 1] = all[16 * k + 9];
  }

  const Vec3<Pack> te = load3(r.t, i - 1), d1e = load3(r.d1, i - 1), tf = load3(r.t, i), d1f = load3(r.d1, i);
  const JointFrames<Pack> s = {
      te, d1e, cross(te, d1e), tf, d1f, cross(tf, d1f), load(r.inverse_length + i - 1), load(r.inverse_length + i)};
  const JointStrains<Pack> k = jointStrains(s);
  min_chi = minimum(1.0 / k.inverse_chi, min_chi);
  JointGradient<Pack> g;
  JointHessian<Pack> h;
  const Pack twist = jointTwist(r, i, s);
  store(r.twist + i, twist);
  const JointResponse<Pack> response = respond<kind>(r, i, k, twist);
  store(buffer.bend_twist + 2, response.energy);
  jointDerivatives<WithHessian, kind == Curvature::compensated>(s, k, response, g, h);

  // stretching of the edge after the joint: 1/2 k_s strain^2 |eBar| (thesis 4.2.1, 4.4.1)
  const Pack ks = load(r.stretch + i), strain = load(r.strain + i) - load(r.rest_strain + i),
             inverse_rest = load(r.inverse_rest_length + i);
  const Pack tension = ks * strain;
  store(buffer.stretch + 2, 0.5 * tension * strain / inverse_rest);
  storeVec(buffer.ge, g.e);
  storeVec(buffer.gf, g.f + s.tf * tension);
  store(buffer.gte + 2, g.theta_e);
  store(buffer.gtf + 2, g.theta_f);
  store(buffer.te_te + 2, h.te_te);
  store(buffer.te_tf + 2, h.te_tf);
  store(buffer.tf_tf + 2, h.tf_tf);
  if (WithHessian)
  {
    storeSym(buffer.ee, h.ee);
    storeSym(buffer.ff, h.ff + symmetricOuter(s.tf * (0.5 * ks * inverse_rest), s.tf) +
                            normalProjector(tension * s.inverse_f, s.tf));
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        store(buffer.ef[a][b] + 2, h.ef.m[a][b]);
    storeVec(buffer.e_te, h.e_te);
    storeVec(buffer.e_tf, h.e_tf);
    storeVec(buffer.f_te, h.f_te);
    storeVec(buffer.f_tf, h.f_tf);
  }
}

/// Writes quantities 8*part .. 8*part+7 of the panels of lanes first..last, the first of them to `panels`.
SLENDER_INLINE void storePart(RodPanel* panels, int first, int last, int part, Pack (&m)[8])
{
  transpose(m);
  for (int k = first; k <= last; ++k)
    store(reinterpret_cast<double*>(panels + k - first) + 8 * part, m[k]);
}

/// Panels of nodes i + first .. i + last from the joints around them. With E the energy as a function of edges, dE/dx_i
/// = dE/de_{i-1} - dE/de_i; the second derivatives follow by the same rule from the blocks of joints i-1 (slot k), i
/// (k+1) and i+1 (k+2).
SLENDER_INLINE void writePanels(const RodArrays& r, const JointBuffer& b, RodPanel* panels, int i, int first, int last)
{
  const auto at = [](const double* p, int slot) { return load(p + slot); };
  const Pack weight = load(r.weight + i), zero = {};
  // edge i with itself, edge i-1 with itself
  Pack own[6], before[6];
  for (int k = 0; k < 6; ++k)
  {
    own[k] = at(b.ff[k], 1) + at(b.ee[k], 2);
    before[k] = at(b.ff[k], 0) + at(b.ee[k], 1);
  }
  constexpr int sym[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  Pack mixed[3];   // edge i with its angle
  for (int a = 0; a < 3; ++a)
    mixed[a] = at(b.f_tf[a], 1) + at(b.e_te[a], 2);

  for (int c = 0; c < 3; ++c)
  {
    Pack m[8];
    for (int a = 0; a < 3; ++a)
    {
      m[a] = at(b.ef[c][a], 1) + at(b.ef[c][a], 2) - own[sym[a][c]];
      m[4 + a] = -at(b.ef[c][a], 2);
    }
    m[3] = -at(b.e_tf[c], 2);
    m[7] = zero;
    storePart(panels, first, last, c, m);
  }
  {
    Pack m[8];
    for (int a = 0; a < 3; ++a)
    {
      m[a] = mixed[a] - at(b.f_te[a], 2);
      m[4 + a] = at(b.f_te[a], 2);
    }
    m[3] = at(b.te_tf, 2);
    m[7] = zero;
    storePart(panels, first, last, 3, m);
  }
  Pack d[4][4] = {};   // d[column][row], row >= column
  for (int c = 0; c < 3; ++c)
  {
    for (int a = c; a < 3; ++a)
      d[c][a] = before[sym[a][c]] + own[sym[a][c]] - at(b.ef[a][c], 1) - at(b.ef[c][a], 1);
    d[c][c] += weight;
    d[c][3] = at(b.e_tf[c], 1) - mixed[c];
  }
  d[3][3] = at(b.tf_tf, 1) + at(b.te_te, 2);
  for (int half = 0; half < 2; ++half)
  {
    Pack m[8];
    for (int k = 0; k < 8; ++k)
      m[k] = d[2 * half + k / 4][k % 4];
    storePart(panels, first, last, 4 + half, m);
  }
}

/// Joints from next_joint on, and the nodes between them.
template <bool WithHessian, Curvature kind>
void evaluateJointsUpTo(const RodArrays& r, RodSweep& sweep, RodPanel* panels, int first_panel, int to)
{
  const int n = r.nodes;
  JointBuffer& b = *reinterpret_cast<JointBuffer*>(&sweep.joints);
  Pack stretch = load(sweep.sums[0]), bend_twist = load(sweep.sums[1]), potential = load(sweep.sums[2]);
  Pack min_chi = load(sweep.sums[3]), max_strain = load(sweep.sums[4]);
  int joint = sweep.next_joint;
  for (; joint - 1 < to; joint += W)
  {
    evaluateJoints<WithHessian, kind>(r, joint, b, min_chi);
    const int i = joint - 1;   // first node whose joints are all known
    const int first = i < 0 ? -i : 0, last = i + W > n ? n - 1 - i : W - 1;

    const Pack weight = load(r.weight + i);
    Pack gradient[4], local_potential = {};
    const auto at = [](const double* p, int slot) { return load(p + slot); };
    for (int a = 0; a < 3; ++a)
    {
      const Pack away = load(r.x[a] + i) - load(r.target[a] + i), force = load(r.force[a] + i);
      local_potential += 0.5 * weight * away * away - force * load(r.x[a] + i);
      gradient[a] = (at(b.gf[a], 0) + at(b.ge[a], 1)) - (at(b.gf[a], 1) + at(b.ge[a], 2)) + weight * away - force;
    }
    gradient[3] = at(b.gtf, 1) + at(b.gte, 2);
    const Pack local_stretch = load(b.stretch + 1), local_bend = load(b.bend_twist + 1),
               local_strain = absolute(load(r.strain + i));
    for (int k = first; k <= last; ++k)
      for (int a = 0; a < 4; ++a)
        r.gradient[4 * (i + k) + a] = gradient[a][k];
    if (first == 0 && last == W - 1)
    {
      stretch += local_stretch;
      bend_twist += local_bend;
      potential += local_potential;
      max_strain = maximum(local_strain, max_strain);
    }
    else
      for (int k = first; k <= last; ++k)
      {
        stretch[0] += local_stretch[k];
        bend_twist[0] += local_bend[k];
        potential[0] += local_potential[k];
        max_strain[0] = local_strain[k] > max_strain[0] ? local_strain[k] : max_strain[0];
      }
    if (WithHessian)
      writePanels(r, b, panels + (i + first - first_panel), i, first, last);
    else
    {
      const Pack diagonal = at(b.tf_tf, 1) + at(b.te_te, 2), off = at(b.te_tf, 2);
      for (int k = first; k <= last; ++k)
      {
        r.theta_diagonal[i + k] = diagonal[k];
        r.theta_off[i + k] = off[k];
      }
    }
  }
  sweep.next_joint = joint;
  sweep.next_node = joint - 1 < n ? joint - 1 : n;
  store(sweep.sums[0], stretch);
  store(sweep.sums[1], bend_twist);
  store(sweep.sums[2], potential);
  store(sweep.sums[3], min_chi);
  store(sweep.sums[4], max_strain);
}

void beginSweep(const RodArrays& r, RodSweep& sweep)
{
  for (auto& quantity : sweep.joints)
    for (double& value : quantity)
      value = 0.0;
  for (auto& lanes : sweep.sums)
    for (double& value : lanes)
      value = 0.0;
  for (double& value : sweep.sums[3])
    value = 2.0;
  sweep.next_edge = 0;
  sweep.next_joint = -1;
  sweep.next_node = 0;
  const int n = r.nodes;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < W + 1; ++i)
      r.x[k][n + i] = r.closed ? r.x[k][i % n] : r.x[k][n - 1] + (i + 1) * (r.x[k][n - 1] - r.x[k][n - 2]);
}

template <Curvature kind>
int advanceSweep(const RodArrays& r, RodSweep& sweep, RodPanel* panels, int first_panel, int to)
{
  const FlushDenormals scope;
  const int n = r.nodes, edges = r.edges;
  if (r.closed || to > n)
    to = n;
  // nodes below `to` come in packs and need the edges one further on
  const int ahead = to + 3 * W < edges ? to + 3 * W : edges;
  if (sweep.next_edge < ahead)
  {
    Pack min_chi = load(sweep.sums[3]);
    evaluateEdges(r, sweep.next_edge, ahead, min_chi);
    store(sweep.sums[3], min_chi);
    if (sweep.next_edge == 0)
      for (int i = 1; i <= 2; ++i)
        copyEdge(r, -i, r.closed ? edges - i : 0);
    sweep.next_edge += (ahead - sweep.next_edge + W - 1) / W * W;
    if (sweep.next_edge >= edges)
      for (int i = 0; i < W + 2; ++i)
        copyEdge(r, edges + i, r.closed ? i % edges : edges - 1);
  }
  if (panels)
    evaluateJointsUpTo<true, kind>(r, sweep, panels, first_panel, to);
  else
    evaluateJointsUpTo<false, kind>(r, sweep, panels, first_panel, to);
  if (sweep.next_node == n)
  {
    if (r.closed)
    {
      r.twist[-1] = r.twist[n - 1];
      r.twist[n] = r.twist[0];
    }
    else
      r.twist[-1] = r.twist[0] = r.twist[n - 1] = r.twist[n] = 0.0;
  }
  return sweep.next_node;
}

RodEvaluation endSweep(const RodSweep& sweep)
{
  RodEvaluation result;
  result.stretch = sum(load(sweep.sums[0]));
  result.bend_twist = sum(load(sweep.sums[1]));
  result.potential = sum(load(sweep.sums[2]));
  for (int k = 0; k < W; ++k)
  {
    result.min_chi = sweep.sums[3][k] < result.min_chi ? sweep.sums[3][k] : result.min_chi;
    result.max_strain = sweep.sums[4][k] > result.max_strain ? sweep.sums[4][k] : result.max_strain;
  }
  return result;
}

}   // namespace

extern const RodKernels kRodKernels;
const RodKernels kRodKernels = {
    beginSweep, {advanceSweep<Curvature::tangent>, advanceSweep<Curvature::compensated>}, endSweep};

}   // namespace SLENDER_ISA
}   // namespace slender
