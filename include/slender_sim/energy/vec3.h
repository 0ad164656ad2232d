#pragma once

/// Minimal vector algebra over a scalar or a SIMD pack T, for energy stencils. Everything is forced inline: the same
/// source is compiled for several instruction sets and no shared symbol may come out of it.
namespace slender {

#define SLENDER_INLINE inline __attribute__((always_inline))

template <class T>
struct Vec3
{
  T x, y, z;
};

/// Point i of three arrays of coordinates.
SLENDER_INLINE Vec3<double> pointAt(double* const* p, int i) { return {p[0][i], p[1][i], p[2][i]}; }

template <class T>
SLENDER_INLINE Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b)
{
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
SLENDER_INLINE Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b)
{
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
SLENDER_INLINE Vec3<T> operator-(const Vec3<T>& a)
{
  return {-a.x, -a.y, -a.z};
}
template <class T>
SLENDER_INLINE Vec3<T> operator*(const Vec3<T>& a, const T& s)
{
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
SLENDER_INLINE T dot(const Vec3<T>& a, const Vec3<T>& b)
{
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
SLENDER_INLINE Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b)
{
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Symmetric 3 x 3 matrix.
template <class T>
struct Sym3
{
  T xx, xy, xz, yy, yz, zz;
};

template <class T>
SLENDER_INLINE Sym3<T> operator+(const Sym3<T>& a, const Sym3<T>& b)
{
  return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
/// a b^T + b a^T
template <class T>
SLENDER_INLINE Sym3<T> symmetricOuter(const Vec3<T>& a, const Vec3<T>& b)
{
  return {a.x * b.x + b.x * a.x, a.x * b.y + b.x * a.y, a.x * b.z + b.x * a.z,
          a.y * b.y + b.y * a.y, a.y * b.z + b.y * a.z, a.z * b.z + b.z * a.z};
}
/// s (I - t t^T)
template <class T>
SLENDER_INLINE Sym3<T> normalProjector(const T& s, const Vec3<T>& t)
{
  return {s - s * t.x * t.x, -s * t.x * t.y, -s * t.x * t.z, s - s * t.y * t.y, -s * t.y * t.z, s - s * t.z * t.z};
}

/// General 3 x 3 matrix, m[row][column].
template <class T>
struct Mat3
{
  T m[3][3];
};

/// A += a b^T
template <class T>
SLENDER_INLINE void addOuter(Mat3<T>& A, const Vec3<T>& a, const Vec3<T>& b)
{
  A.m[0][0] += a.x * b.x;
  A.m[0][1] += a.x * b.y;
  A.m[0][2] += a.x * b.z;
  A.m[1][0] += a.y * b.x;
  A.m[1][1] += a.y * b.y;
  A.m[1][2] += a.y * b.z;
  A.m[2][0] += a.z * b.x;
  A.m[2][1] += a.z * b.y;
  A.m[2][2] += a.z * b.z;
}
/// A += [a]_x, the matrix with [a]_x b = a x b
template <class T>
SLENDER_INLINE void addCross(Mat3<T>& A, const Vec3<T>& a)
{
  A.m[0][1] -= a.z;
  A.m[0][2] += a.y;
  A.m[1][0] += a.z;
  A.m[1][2] -= a.x;
  A.m[2][0] -= a.y;
  A.m[2][1] += a.x;
}

}   // namespace slender
