! An owner of all voxels of "fortran", until its input ends. Field "same" has the values of owner.c: time 1 in the library's memory, time 2
! copied. Field "other" has others.
program owner_in_fortran
  use, intrinsic :: iso_c_binding
  use slabstream_insitu
  implicit none
  integer, parameter :: side = 24
  type(insitu_owner) :: owner, other
  real(c_float), pointer :: memory(:, :, :)
  real(c_float), target :: field(0:side + 1, side, side)
  real(c_double) :: feed(1), waited
  logical :: looked_at
  integer :: x, y, z, code
  character :: line

  call owner%open("fortran", "float", [side, side, side], code=code)
  if (code /= 1 .or. index(insitu_error(), "samples is 'float'") /= 1) error stop "a wrong type is no error"
  call owner%open("fortran", "float32", [side, side, side], spacing=[1d0, 1d0, 2d0], fields="same,other")
  call owner%add_box([1, 1, 1], [side, side, side], array_first=[0, 1, 1], array_last=[side + 1, side, side])
  call owner%parameter("feed", 0d0, 1d0, 0.25d0)
  call owner%start()
  call owner%poll(looked_at, feed)
  if (looked_at .or. abs(feed(1) - 0.25d0) > 1d-9) error stop "poll"

  call owner%begin(60d0, waited)
  call owner%array(1, memory)
  if (any(lbound(memory) /= [0, 1, 1]) .or. any(ubound(memory) /= [side + 1, side, side])) error stop "bounds"
  field = 1000  ! also ghosts, which lie outside of the volume
  do concurrent (x = 1:side, y = 1:side, z = 1:side)
    field(x, y, z) = real(4 * (x - 1) + 2 * (y - 1) + z - 1)
  end do
  memory = field
  call owner%commit(1_c_int64_t, 0d0)
  call owner%publish(2_c_int64_t, 0.5d0, [c_loc(field)], 60d0)

  call other%open("fortran", "float32", [side, side, side], spacing=[1d0, 1d0, 2d0], fields="same,other", field=1)
  call other%add_box([1, 1, 1], [side, side, side], array_first=[0, 1, 1], array_last=[side + 1, side, side])
  call other%start()
  field = 200 - field
  call other%publish(2_c_int64_t, 0.5d0, [c_loc(field)], 60d0)
  print "(a)", "published"
  flush (6)
  read (*, "(a)", iostat=code) line
  call other%close()
  call owner%close()
end program
