/// The irradiance in the corridor of rooms_in_a_row.py by a way of its own: light is traced from the lamp.
///
///     cmake --build build/release --target corridor_reference
///     build/release/corridor_reference 1000000 < tests/rooms/corridor_12/points.csv > reference.csv
///
/// A path from a sensor finds the lamp eleven rooms away once in some ten thousand times: `lichthof probe --method reference`
/// would need hours for the last rooms. Here a particle that enters the next room becomes `split` of 1 / split the weight
/// (on average), and of `split` that go back one is left, so that every room sees about as many. Where a particle is
/// reflected it lights the points it sees, as a surface of Lambert would. Neither changes an expectation. The spread of
/// `batches` gives each point's standard error, the tenth column; stderr has the rooms' means.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <vector>

namespace {

using Vec = std::array<double, 3>;

// The corridor, as rooms_in_a_row.py writes it.
constexpr int rooms = 12, points_per_room = 12;
constexpr double length = 1.6, depth = 3.0, height = 2.2, wall = 0.1, step = length + wall, reflectance = 0.9;
constexpr double door_left[] = {0.2, 0.85, 1.5, 0.85}, door_width = 1.3, door_head = 2.0;
constexpr double lamp_side = 0.6, lamp_x = (length - lamp_side) / 2, lamp_y = (depth - lamp_side) / 2,
                 lamp_z = height - 0.02, radiance = 100;

constexpr double split = 2.4;
constexpr int batches = 20;

struct Point {
  Vec place, normal;
};
struct Particle {
  int room;
  bool is_in_doorway;  ///< the one after the room
  Vec place, direction;
};
using Light = std::array<double, rooms * points_per_room>;

bool is_in_door(int door, double y, double z) {
  const double left = door_left[door % 4];
  return y > left && y < left + door_width && z < door_head;
}

/// Whether the lamp, which is black on both sides, stands between two places of the first room.
bool is_behind_lamp(const Vec& a, const Vec& b) {
  if ((a[2] - lamp_z) * (b[2] - lamp_z) >= 0) return false;
  const double t = (lamp_z - a[2]) / (b[2] - a[2]), x = a[0] + t * (b[0] - a[0]), y = a[1] + t * (b[1] - a[1]);
  return x > lamp_x && x < lamp_x + lamp_side && y > lamp_y && y < lamp_y + lamp_side;
}

/// Whether a place is seen from a point: where the line between them passes a wall there is a door.
bool sees(const Vec& place, const Vec& point) {
  for (int door = 0; door < rooms - 1; ++door)
    for (const double x : {door * step + length, (door + 1) * step}) {
      if ((place[0] - x) * (point[0] - x) >= 0) continue;
      const double t = (x - place[0]) / (point[0] - place[0]);
      if (!is_in_door(door, place[1] + t * (point[1] - place[1]), place[2] + t * (point[2] - place[2]))) return false;
    }
  return !is_behind_lamp(place, point);
}

class Tracer {
 public:
  Tracer(const std::vector<Point>& points, unsigned seed) : points_(points), engine_(seed) {}

  /// One particle from the lamp, and all it becomes.
  void trace(double flux) {
    const Vec down{0, 0, -1}, from{lamp_x + lamp_side * chance(), lamp_y + lamp_side * chance(), lamp_z};
    shine(from, down, flux);
    std::vector<Particle> waiting{{0, false, from, scattered(2, -1)}};
    while (!waiting.empty()) {
      const Particle particle = waiting.back();
      waiting.pop_back();
      follow(particle, flux, waiting);
    }
  }
  const Light& light() const { return light_; }

 private:
  double chance() { return uniform_(engine_); }

  /// A direction with the density cos / pi about an axis.
  Vec scattered(std::size_t axis, double sign) {
    const double r2 = chance(), phi = 2 * std::numbers::pi * chance();
    Vec d{};
    d[axis] = sign * std::sqrt(1 - r2);
    d[(axis + 1) % 3] = std::sqrt(r2) * std::cos(phi);
    d[(axis + 2) % 3] = std::sqrt(r2) * std::sin(phi);
    return d;
  }

  /// Adds what a small surface that sends `flux` brings the points.
  void shine(const Vec& place, const Vec& normal, double flux) {
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Point& point = points_[k];
      Vec d;
      double out = 0, into = 0, square = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        d[i] = point.place[i] - place[i];
        out += d[i] * normal[i], into -= d[i] * point.normal[i], square += d[i] * d[i];
      }
      if (out <= 0 || into <= 0 || !sees(place, point.place)) continue;
      light_[k] += flux * out * into / (std::numbers::pi * square * square);
    }
  }

  /// To the end of the box it is in: a door, a wall, the lamp.
  void follow(const Particle& at, double flux, std::vector<Particle>& waiting) {
    const double begin = at.room * step, left = door_left[at.room % 4];
    const Vec low = at.is_in_doorway ? Vec{begin + length, left, 0} : Vec{begin, 0, 0};
    const Vec high =
        at.is_in_doorway ? Vec{begin + step, left + door_width, door_head} : Vec{begin + length, depth, height};
    const Vec& d = at.direction;
    std::size_t axis = 0;
    double nearest = HUGE_VAL;
    for (std::size_t k = 0; k < 3; ++k) {
      const double t = d[k] == 0 ? HUGE_VAL : ((d[k] > 0 ? high : low)[k] - at.place[k]) / d[k];
      if (t < nearest) nearest = t, axis = k;
    }
    Vec there;
    for (std::size_t k = 0; k < 3; ++k) there[k] = at.place[k] + nearest * d[k];
    there[axis] = (d[axis] > 0 ? high : low)[axis];
    if (at.room == 0 && is_behind_lamp(at.place, there)) return;

    if (axis == 0 && at.is_in_doorway) {
      const bool is_next = d[0] > 0;
      const int copies = is_next ? static_cast<int>(split) + (chance() < split - std::floor(split)) : 1;
      waiting.insert(waiting.end(), static_cast<std::size_t>(copies), {at.room + is_next, false, there, d});
      return;
    }
    if (axis == 0 && d[0] > 0 && at.room < rooms - 1 && is_in_door(at.room, there[1], there[2])) {
      waiting.push_back({at.room, true, there, d});
      return;
    }
    if (axis == 0 && d[0] < 0 && at.room > 0 && is_in_door(at.room - 1, there[1], there[2])) {
      if (chance() * split < 1) waiting.push_back({at.room - 1, true, there, d});
      return;
    }
    if (chance() >= reflectance) return;
    const double sign = d[axis] > 0 ? -1 : 1;
    Vec normal{};
    normal[axis] = sign;
    shine(there, normal, flux / std::pow(split, at.room));
    waiting.push_back({at.room, at.is_in_doorway, there, scattered(axis, sign)});
  }

  const std::vector<Point>& points_;
  std::mt19937_64 engine_;
  std::uniform_real_distribution<double> uniform_;
  Light light_{};
};

struct Mean {
  double value, error;
};
Mean mean(const std::array<double, batches>& values) {
  double sum = 0, squares = 0;
  for (const double value : values) sum += value / batches;
  for (const double value : values) squares += (value - sum) * (value - sum);
  return {sum, std::sqrt(squares / (batches - 1) / batches)};
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc == 2 ? std::atoi(argv[1]) / batches : 0;
  std::vector<Point> points;
  std::scanf("%*[^\n]");
  for (Point p; std::scanf("%lf,%lf,%lf,%lf,%lf,%lf", &p.place[0], &p.place[1], &p.place[2], &p.normal[0], &p.normal[1],
                           &p.normal[2]) == 6;)
    points.push_back(p);
  if (count < 1 || points.size() != std::tuple_size_v<Light>) {
    std::fprintf(stderr, "usage: corridor_reference PARTICLES < points.csv > reference.csv\n");
    return 2;
  }
  std::vector<Light> lights;
  for (unsigned batch = 0; batch < batches; ++batch) {
    Tracer tracer(points, batch);
    for (int k = 0; k < count; ++k) tracer.trace(std::numbers::pi * radiance * lamp_side * lamp_side / count);
    lights.push_back(tracer.light());
  }
  std::printf("x,y,z,nx,ny,nz,Er,Eg,Eb,se\n");
  for (std::size_t room = 0; room < rooms; ++room) {
    std::array<double, batches> sums{};
    for (std::size_t k = room * points_per_room; k < (room + 1) * points_per_room; ++k) {
      std::array<double, batches> values;
      for (std::size_t b = 0; b < batches; ++b) values[b] = lights[b][k], sums[b] += values[b] / points_per_room;
      const Mean e = mean(values);
      const Point& p = points[k];
      std::printf("%.9g,%.9g,%.9g,%g,%g,%g,%.6g,%.6g,%.6g,%.3g\n", p.place[0], p.place[1], p.place[2], p.normal[0],
                  p.normal[1], p.normal[2], e.value, e.value, e.value, e.error);
    }
    const Mean e = mean(sums);
    std::fprintf(stderr, "room %zu: %.4g W/m2, standard error %.2f %%\n", room + 1, e.value, 100 * e.error / e.value);
  }
}
