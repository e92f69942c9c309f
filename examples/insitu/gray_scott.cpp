// Two chemicals that react and diffuse (Gray and Scott 1984; Pearson 1993 shows the patterns in two dimensions): gray_scott [SIDE [STEPS
// [EVERY]]] on any number of MPI processes. Each computes one box of a periodic cube with SIDE voxels a side. Every EVERY steps the
// chemical V is drawn by a Slabstream service, as the dataset "gray-scott", from the memory that this program computes it in: nothing is
// copied. `feed`, the rate at which the chemical U comes in, may be changed while the program runs.
#include <mpi.h>
#include <slabstream_insitu.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <utility>
#include <vector>

namespace {

using Index = std::array<int, 3>;  // x, y, z

constexpr float kDiffuseU = 0.2F, kDiffuseV = 0.1F, kKill = 0.048F;
constexpr double kFeed = 0.02, kLeastFeed = 0.005, kMostFeed = 0.06;

// The box of a process and a layer of ghosts around it, x fastest.
struct Grid {
  Index begin = {}, end = {};  // voxels of the cube
  Index size() const { return {end[0] - begin[0] + 2, end[1] - begin[1] + 2, end[2] - begin[2] + 2}; }
  std::size_t voxels() const { return std::size_t(size()[0]) * size()[1] * size()[2]; }
  std::size_t At(int x, int y, int z) const { return (std::size_t(z) * size()[1] + y) * size()[0] + x; }  // (1, 1, 1) is `begin`
};

// Copies the outer layers of each box into its neighbours' ghosts, axis after axis.
class Ghosts {
 public:
  Ghosts(MPI_Comm grid_of_processes, const Grid& grid) : comm_(grid_of_processes) {
    const Index size = grid.size();
    const int sizes[3] = {size[2], size[1], size[0]};  // C's order
    for (int axis = 0; axis < 3; ++axis) {
      MPI_Cart_shift(comm_, axis, 1, &before_[axis], &after_[axis]);
      int layer[3] = {sizes[0], sizes[1], sizes[2]};
      layer[2 - axis] = 1;
      for (int at = 0; at < 4; ++at) {  // the lower ghosts, the first own layer, the last one, the upper ghosts
        int starts[3] = {0, 0, 0};
        starts[2 - axis] = at < 2 ? at : size[axis] - 4 + at;
        MPI_Type_create_subarray(3, sizes, layer, starts, MPI_ORDER_C, MPI_FLOAT, &layers_[axis][at]);
        MPI_Type_commit(&layers_[axis][at]);
      }
    }
  }

  void Exchange(float* field) const {
    for (int axis = 0; axis < 3; ++axis) {
      const auto& [lower, first, last, upper] = layers_[axis];
      MPI_Sendrecv(field, 1, first, before_[axis], 0, field, 1, upper, after_[axis], 0, comm_, MPI_STATUS_IGNORE);
      MPI_Sendrecv(field, 1, last, after_[axis], 1, field, 1, lower, before_[axis], 1, comm_, MPI_STATUS_IGNORE);
    }
  }

 private:
  MPI_Comm comm_;
  std::array<int, 3> before_ = {}, after_ = {};
  std::array<std::array<MPI_Datatype, 4>, 3> layers_ = {};
};

// U is 1 and V is 0, but for a cube in the middle and some voxels around it.
void Fill(const Grid& grid, int side, float* u, float* v) {
  std::uint32_t random = 0;
  for (int z = 0; z < grid.size()[2]; ++z) {
    for (int y = 0; y < grid.size()[1]; ++y) {
      for (int x = 0; x < grid.size()[0]; ++x) {
        const Index voxel = {grid.begin[0] + x - 1, grid.begin[1] + y - 1, grid.begin[2] + z - 1};
        bool inside = true;
        for (const int at : voxel) inside = inside && std::abs(at - side / 2) <= side / 16;
        random = random * 1664525U + 1013904223U;
        const float noise = 0.02F * float(random >> 8) / float(1 << 24);
        u[grid.At(x, y, z)] = inside ? 0.25F : 1;
        v[grid.At(x, y, z)] = inside ? 0.33F + noise : 0;
      }
    }
  }
}

void Step(const Grid& grid, float feed, const float* u, const float* v, float* next_u, float* next_v) {
  const std::size_t row = grid.size()[0], slice = row * grid.size()[1];
  const auto around = [&](const float* field, std::size_t i) {
    return (field[i - 1] + field[i + 1] + field[i - row] + field[i + row] + field[i - slice] + field[i + slice]) / 6 - field[i];
  };
  for (int z = 1; z < grid.size()[2] - 1; ++z) {
    for (int y = 1; y < grid.size()[1] - 1; ++y) {
      for (std::size_t i = grid.At(1, y, z), end = i + row - 2; i < end; ++i) {
        const float reaction = u[i] * v[i] * v[i];
        next_u[i] = u[i] + kDiffuseU * around(u, i) - reaction + feed * (1 - u[i]);
        next_v[i] = v[i] + kDiffuseV * around(v, i) + reaction - (feed + kKill) * v[i];
      }
    }
  }
}

// Says what went wrong, and goes on: pictures are not worth a simulation.
bool Ok(int code) {
  if (code != 0) std::cerr << "gray_scott: " << slabstream_insitu_error() << '\n';
  return code == 0;
}

int Run(int side, std::uint64_t steps, std::uint64_t every) {
  int ranks = 0, rank = 0, processes[3] = {};
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  MPI_Dims_create(ranks, 3, processes);
  const int periodic[3] = {1, 1, 1};
  MPI_Comm comm = MPI_COMM_NULL;
  MPI_Cart_create(MPI_COMM_WORLD, 3, processes, periodic, 0, &comm);
  MPI_Comm_rank(comm, &rank);
  int place[3] = {};
  MPI_Cart_coords(comm, rank, 3, place);
  if (side < processes[0] || side > 4096) {
    if (rank == 0) std::cerr << "gray_scott: SIDE " << side << ", must be in [" << processes[0] << ", 4096]\n";
    return 2;
  }
  Grid grid;
  for (int axis = 0; axis < 3; ++axis) {
    grid.begin[axis] = side * place[axis] / processes[axis];
    grid.end[axis] = side * (place[axis] + 1) / processes[axis];
  }

  slabstream_insitu_field field = {};
  field.dataset = "gray-scott";
  field.samples = "float32";
  for (int& voxels : field.size) voxels = side;
  field.owner = std::uint32_t(rank);
  field.owners = std::uint32_t(ranks);
  const std::int32_t array_begin[3] = {grid.begin[0] - 1, grid.begin[1] - 1, grid.begin[2] - 1};
  const std::int32_t array_end[3] = {grid.end[0] + 1, grid.end[1] + 1, grid.end[2] + 1};
  slabstream_insitu* owner = nullptr;
  const bool shown = Ok(slabstream_insitu_open(&owner, &field)) &&
                     Ok(slabstream_insitu_add_box(owner, grid.begin.data(), grid.end.data(), array_begin, array_end, nullptr)) &&
                     Ok(slabstream_insitu_parameter(owner, "feed", kLeastFeed, kMostFeed, kFeed)) && Ok(slabstream_insitu_start(owner));

  const Ghosts ghosts(comm, grid);
  std::vector<float> u(grid.voxels()), next_u(grid.voxels()), own_v(grid.voxels()), spare_v(grid.voxels());
  float *v = own_v.data(), *spare = spare_v.data();
  Fill(grid, side, u.data(), v);
  ghosts.Exchange(v);
  double feed = kFeed;
  const double started = MPI_Wtime();
  for (std::uint64_t step = 1; step <= steps; ++step) {
    if (shown && rank == 0) slabstream_insitu_poll(owner, nullptr, &feed);
    MPI_Bcast(&feed, 1, MPI_DOUBLE, 0, comm);  // all ranks use it from the same step on
    void* slot = nullptr;
    const bool show = shown && step % every == 0 && Ok(slabstream_insitu_begin(owner, 60, &slot, nullptr));
    float* const next_v = show ? static_cast<float*>(slot) : spare;
    Step(grid, float(feed), u.data(), v, next_u.data(), next_v);
    ghosts.Exchange(next_u.data());
    ghosts.Exchange(next_v);
    if (show) Ok(slabstream_insitu_commit(owner, step, double(step)));
    std::swap(u, next_u);
    if (!show) spare = next_v == own_v.data() ? spare_v.data() : own_v.data();
    v = next_v;
  }
  if (rank == 0) std::cout << steps << " steps, " << 1e3 * (MPI_Wtime() - started) / double(steps) << " ms each\n";
  slabstream_insitu_close(owner);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const auto number = [&](int i, long usual) { return argc > i ? std::atol(argv[i]) : usual; };
  const long side = number(1, 128), steps = number(2, 100000), every = number(3, 10);
  int status = 2;
  if (side > 0 && steps > 0 && every > 0) {
    status = Run(int(side), std::uint64_t(steps), std::uint64_t(every));
  } else {
    std::cerr << "usage: gray_scott [SIDE [STEPS [EVERY]]]\n";
  }
  MPI_Finalize();
  return status;
}
