/* Lets a Slabstream service draw a field while a simulation computes it, out of the simulation's own processes. C99 and C++. It knows no
 * MPI: each process (rank) is one owner of the field, by its number.
 *
 *   #include <slabstream_insitu.h>
 *
 *   slabstream_insitu* owner = NULL;
 *   slabstream_insitu_field field = {.dataset = "rho", .samples = "float32", .size = {512, 512, 512}, .owner = rank, .owners = ranks};
 *   slabstream_insitu_open(&owner, &field);
 *   slabstream_insitu_add_box(owner, begin, end, NULL, NULL, NULL);
 *   slabstream_insitu_start(owner);
 *   for (uint64_t step = 1; step <= steps; ++step) {
 *     advance(rho);
 *     slabstream_insitu_publish(owner, step, step * dt, (const void* const*)&rho, NULL, 60);
 *   }
 *   slabstream_insitu_close(owner);
 *
 * All functions but error and version return 0 or a slabstream_insitu_code. None throws, prints, or ends the process. A simulation may go
 * on after any error, and whether there is a service or not: the owner registers when one is there. Pictures appear once all owners of the
 * field have committed a time.
 *
 * Threads: a handle is for one thread at a time. It has threads of its own, which sleep unless somebody looks at the field.
 * Link with libslabstream: CMake target Slabstream::client of find_package(Slabstream), or pkg-config slabstream. */
#ifndef SLABSTREAM_INSITU_H
#define SLABSTREAM_INSITU_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SLABSTREAM_INSITU_API __attribute__((visibility("default")))

/* Why a function failed. */
typedef enum {
  SLABSTREAM_INSITU_INVALID_ARGUMENT = 1,   /* an argument is wrong, a call is out of order, or the service refuses the field */
  SLABSTREAM_INSITU_NOT_FOUND = 2,          /* there is no such service file */
  SLABSTREAM_INSITU_UNAVAILABLE = 3,        /* not now: pictures use all slots, or another process is this owner */
  SLABSTREAM_INSITU_RESOURCE_EXHAUSTED = 4, /* not enough memory */
  SLABSTREAM_INSITU_INTERNAL = 8            /* a mistake of Slabstream */
} slabstream_insitu_code;

/* A field on a grid, and this process's place among the processes that hold it. All of them state the same, but for `owner` and `service`.
 * Numbers and pointers that are 0 have the default, if one is named. Axes are x, y, z. */
typedef struct {
  const char* dataset; /* its name in the service: 1 to 256 letters, digits, '.', '_' or '-' */
  const char* samples; /* int8, uint8, int16, uint16, int32, uint32, int64, uint64, float16, float32 or float64 */
  int32_t size[3];     /* voxels of the whole field, [1, 65535] */
  double spacing[3];   /* distance of neighbouring voxels, > 0; default 1 */
  double origin[3];    /* centre of voxel 0, 0, 0 */
  uint32_t owner;      /* [0, owners) */
  uint32_t owners;     /* [1, 4096]; default 1 */
  uint32_t slots;      /* times that the owner has memory for, [2, 8]; default 3. More of them: fewer waits while somebody looks */
  /* owner.json of a service with keys, or the endpoint of a service for its workers, "tcp://HOST:PORT". Default: what
   * $SLABSTREAM_OWNER_SERVICE names, else the service that `slabstream up` started last on this host, else tcp://127.0.0.1:7421. */
  const char* service;
  const char* fields; /* names of all fields of the dataset, on this grid and of these samples, at most 64, commas between them: "u,v".
                       * Default: it has one without a name. Each field has `owners` owners of its own, at most 4096 in all. */
  uint32_t field;     /* which of them this is, from 0 */
} slabstream_insitu_field;

typedef struct slabstream_insitu slabstream_insitu;

/* Makes a handle, which close ends; NULL if it fails. Texts are copied. */
SLABSTREAM_INSITU_API int slabstream_insitu_open(slabstream_insitu** handle, const slabstream_insitu_field* field);

/* Before start: this process owns the voxels [begin, end); at most 4096 boxes, and 65536 of all owners. The boxes of all owners tile the
 * field. The box's array has the voxels [array_begin, array_end): these, and ghosts. Ghosts inside the field have the values of their
 * owners whenever the array is committed, so that pictures need not fetch them; those outside of it are never read. NULLs: no ghosts.
 * `strides`: samples from a voxel of the library's array to the next one along each axis, at least 1; NULL: x fastest, without gaps. */
SLABSTREAM_INSITU_API int slabstream_insitu_add_box(slabstream_insitu* handle, const int32_t begin[3], const int32_t end[3],
                                                    const int32_t array_begin[3], const int32_t array_end[3], const int64_t strides[3]);

/* Before start: declares a number that clients may change within [least, most]; its first value is `value`. The name has up to 64 letters,
 * digits and '_', no digit first. At most 64 of them. Those of owner 0 of field 0 are used; others may declare them,
 * too. */
SLABSTREAM_INSITU_API int slabstream_insitu_parameter(slabstream_insitu* handle, const char* name, double least, double most, double value);

/* How boxes are made on demand. make: sets `samples` to the first sample of the array of the box (its number in the order of add_box) at a
 * time. They stay until drop is told. It may take long, but must end soon once close is called. If it returns a slabstream_insitu_code,
 * pictures that need the box fail with the line that it writes into `error`, which has room for `error_bytes`. drop: nobody reads these
 * samples any more. Both are called on threads of the library, or within begin, adopt and close. */
typedef struct {
  int (*make)(void* context, uint32_t box, uint64_t time, const void** samples, char* error, uint32_t error_bytes);
  void (*drop)(void* context, uint32_t box, uint64_t time, const void* samples);
  void* context;
  uint64_t most_bytes; /* of samples that are kept, those that were asked for last; one box is kept in any case */
} slabstream_insitu_maker;

/* Before start, and in all owners of the field: boxes are made when a picture needs them. Each time is then committed by adopt, whose
 * pointers are NULL. */
SLABSTREAM_INSITU_API int slabstream_insitu_on_demand(slabstream_insitu* handle, const slabstream_insitu_maker* maker);

/* Takes the memory of all slots, and begins to look for the service. INVALID_ARGUMENT names what is wrong with field, boxes or parameters.
 */
SLABSTREAM_INSITU_API int slabstream_insitu_start(slabstream_insitu* handle);

/* Memory for the arrays of the next time, so that nothing is copied: sets pointers[i] to the first sample of the array of box i, at a
 * multiple of 64 bytes. What they hold is that of an older time, or 0. It is never the memory of the last commit, from which the simulation
 * may compute the next time. Write all samples and commit; until then, begin gives the same memory again. A slot that a picture may use is
 * not given away: begin waits up to `timeout_seconds` (0: not at all) and tells how long in `waited_seconds`, if that is not NULL.
 * UNAVAILABLE: it waited in vain. */
SLABSTREAM_INSITU_API int slabstream_insitu_begin(slabstream_insitu* handle, double timeout_seconds, void** pointers,
                                                  double* waited_seconds);

/* The arrays are whole. `time`: at least 1, above that of the last commit, and the same numbers in all owners. A time that only some owners
 * commit shows as an error, not as a picture. `simulated`: the simulation's own time, in its own unit. */
SLABSTREAM_INSITU_API int slabstream_insitu_commit(slabstream_insitu* handle, uint64_t time, double simulated);

/* begin, a copy from the simulation's own arrays, and commit. pointers[i]: the first sample of the array of box i. strides[i]: samples from
 * a voxel to the next one there, negative ones, too; NULL: as add_box says. If it fails, nothing was committed. */
SLABSTREAM_INSITU_API int slabstream_insitu_publish(slabstream_insitu* handle, uint64_t time, double simulated, const void* const* pointers,
                                                    const int64_t (*strides)[3], double timeout_seconds);

/* begin and commit without a copy and without memory of the library: samples are read where they lie in this process, by workers on its
 * host through the kernel (process_vm_readv). pointers[i]: the first sample of the array of box i, with the strides of add_box. The arrays
 * of a time must not change or go until `freed` names that time, or close returns. Each call sets `freed`, if it is not NULL, to the time
 * whose arrays nobody reads any more, or to 0. If it fails, the arrays of this call are not read. */
SLABSTREAM_INSITU_API int slabstream_insitu_adopt(slabstream_insitu* handle, uint64_t time, double simulated, const void* const* pointers,
                                                  double timeout_seconds, uint64_t* freed);

/* What the service has said last; it never waits. looked_at: 1 if somebody has asked for a picture within the last seconds, else 0. values:
 * those of all parameters, in the order of their declaration. Either may be NULL. Owner 0 alone hears of new values; others get what they
 * declared. Let it broadcast what it gets (MPI_Bcast), so that all use a value from the same step on. */
SLABSTREAM_INSITU_API int slabstream_insitu_poll(slabstream_insitu* handle, int* looked_at, double* values);

/* Leaves the service and frees the handle and its memory; NULL: does nothing. */
SLABSTREAM_INSITU_API void slabstream_insitu_close(slabstream_insitu* handle);

/* One line on why the last function of this thread that failed did so. It is overwritten by the next failure. */
SLABSTREAM_INSITU_API const char* slabstream_insitu_error(void);

/* The library's version, "0.2.0". */
SLABSTREAM_INSITU_API const char* slabstream_insitu_version(void);

#ifdef __cplusplus
}
#endif

#endif
