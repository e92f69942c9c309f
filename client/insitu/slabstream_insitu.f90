! The in situ interface in Fortran 2008, over slabstream_insitu.h, which says what each function does. Compile this file with the program, and
! link with libslabstream.
!
!   type(insitu_owner) :: owner
!   real(c_float), pointer :: rho(:, :, :)
!   call owner%open("rho", "float32", [512, 512, 512], owner=rank, owners=ranks)
!   call owner%add_box(first, last)                 ! voxels count from 1; first and last are this process's own
!   call owner%start()
!   do step = 1, steps
!     call owner%begin(60d0)
!     call owner%array(1, rho)                      ! rho(first(1):last(1), first(2):last(2), first(3):last(3)), in the library's memory
!     ...
!     call owner%commit(int(step, c_int64_t), step * dt)
!   end do
!   call owner%close()
!
! With the optional argument `code` a procedure sets it to 0 or to the code of an error, whose line insitu_error() has; without it, an error
! stops the program with that line.
module slabstream_insitu
  use, intrinsic :: iso_c_binding
  implicit none
  private
  public :: insitu_owner, insitu_error

  type, bind(c) :: c_field
    type(c_ptr) :: dataset, samples
    integer(c_int32_t) :: size(3)
    real(c_double) :: spacing(3), origin(3)
    integer(c_int32_t) :: owner, owners, slots
    type(c_ptr) :: service, fields
    integer(c_int32_t) :: field
  end type

  type :: insitu_owner
    private
    type(c_ptr) :: handle = c_null_ptr
    integer :: parameters = 0
    integer, allocatable :: first(:, :), last(:, :)  ! voxels of the array of each box
    type(c_ptr), allocatable :: arrays(:)
  contains
    procedure :: open => owner_open, add_box, parameter => owner_parameter, start
    procedure :: begin, commit, publish, poll, close => owner_close
    procedure, private :: array_float, array_double
    generic :: array => array_float, array_double
  end type

  interface
    integer(c_int) function c_open(handle, field) bind(c, name="slabstream_insitu_open")
      import
      type(c_ptr), intent(out) :: handle
      type(c_field), intent(in) :: field
    end function
    integer(c_int) function c_add_box(handle, box_begin, box_end, array_begin, array_end, strides) &
        bind(c, name="slabstream_insitu_add_box")
      import
      type(c_ptr), value :: handle, strides
      integer(c_int32_t), intent(in) :: box_begin(3), box_end(3), array_begin(3), array_end(3)
    end function
    integer(c_int) function c_parameter(handle, name, least, most, value) bind(c, name="slabstream_insitu_parameter")
      import
      type(c_ptr), value :: handle
      character(kind=c_char), intent(in) :: name(*)
      real(c_double), value :: least, most, value
    end function
    integer(c_int) function c_start(handle) bind(c, name="slabstream_insitu_start")
      import
      type(c_ptr), value :: handle
    end function
    integer(c_int) function c_begin(handle, timeout, arrays, waited) bind(c, name="slabstream_insitu_begin")
      import
      type(c_ptr), value :: handle
      real(c_double), value :: timeout
      type(c_ptr), intent(out) :: arrays(*)
      real(c_double), intent(out) :: waited
    end function
    integer(c_int) function c_commit(handle, time, simulated) bind(c, name="slabstream_insitu_commit")
      import
      type(c_ptr), value :: handle
      integer(c_int64_t), value :: time
      real(c_double), value :: simulated
    end function
    integer(c_int) function c_publish(handle, time, simulated, arrays, strides, timeout) bind(c, name="slabstream_insitu_publish")
      import
      type(c_ptr), value :: handle, strides
      integer(c_int64_t), value :: time
      real(c_double), value :: simulated, timeout
      type(c_ptr), intent(in) :: arrays(*)
    end function
    integer(c_int) function c_poll(handle, looked_at, values) bind(c, name="slabstream_insitu_poll")
      import
      type(c_ptr), value :: handle
      integer(c_int), intent(out) :: looked_at
      real(c_double), intent(out) :: values(*)
    end function
    subroutine c_close(handle) bind(c, name="slabstream_insitu_close")
      import
      type(c_ptr), value :: handle
    end subroutine
    type(c_ptr) function c_error() bind(c, name="slabstream_insitu_error")
      import
    end function
    integer(c_size_t) function strlen(text) bind(c)
      import
      type(c_ptr), value :: text
    end function
  end interface

contains

  function insitu_error() result(line)
    character(:), allocatable :: line
    character(kind=c_char), pointer :: text(:)
    integer :: i
    call c_f_pointer(c_error(), text, [strlen(c_error())])
    allocate (character(size(text)) :: line)
    do i = 1, size(text)
      line(i:i) = text(i)
    end do
  end function

  subroutine tell(failure, code)
    integer(c_int), intent(in) :: failure
    integer, intent(out), optional :: code
    if (present(code)) then
      code = failure
    else if (failure /= 0) then
      error stop insitu_error()
    end if
  end subroutine

  ! owner: from 0, as MPI counts ranks. fields: names of all fields of the dataset, "u,v"; field: which of them this is, from 0
  subroutine owner_open(this, dataset, samples, size, owner, owners, spacing, origin, slots, service, fields, field, code)
    class(insitu_owner), intent(inout) :: this
    character(*), intent(in) :: dataset, samples
    integer, intent(in) :: size(3)
    integer, intent(in), optional :: owner, owners, slots, field
    real(c_double), intent(in), optional :: spacing(3), origin(3)
    character(*), intent(in), optional :: service, fields
    integer, intent(out), optional :: code
    character(:), allocatable, target :: dataset_text, samples_text, service_text, fields_text
    type(c_field) :: as
    dataset_text = trim(dataset) // c_null_char
    samples_text = trim(samples) // c_null_char
    as = c_field(c_loc(dataset_text), c_loc(samples_text), size, 0, 0, 0, 0, 0, c_null_ptr, c_null_ptr, 0)
    if (present(owner)) as%owner = owner
    if (present(owners)) as%owners = owners
    if (present(slots)) as%slots = slots
    if (present(field)) as%field = field
    if (present(spacing)) as%spacing = spacing
    if (present(origin)) as%origin = origin
    if (present(service)) then
      service_text = trim(service) // c_null_char
      as%service = c_loc(service_text)
    end if
    if (present(fields)) then
      fields_text = trim(fields) // c_null_char
      as%fields = c_loc(fields_text)
    end if
    this%parameters = 0
    this%first = reshape([integer ::], [3, 0])
    this%last = this%first
    this%arrays = [c_ptr ::]
    call tell(c_open(this%handle, as), code)
  end subroutine

  ! The first and the last voxel that it owns, by axis, and those of its array, which may have ghosts.
  subroutine add_box(this, first, last, array_first, array_last, code)
    class(insitu_owner), intent(inout) :: this
    integer, intent(in) :: first(3), last(3)
    integer, intent(in), optional :: array_first(3), array_last(3)
    integer, intent(out), optional :: code
    integer(c_int32_t) :: from(3), to(3)
    integer(c_int) :: failure
    from = first
    to = last
    if (present(array_first)) from = array_first
    if (present(array_last)) to = array_last
    failure = c_add_box(this%handle, int(first - 1, c_int32_t), int(last, c_int32_t), from - 1, to, c_null_ptr)
    if (failure == 0) then
      this%first = reshape([this%first, from], [3, size(this%arrays) + 1])
      this%last = reshape([this%last, to], [3, size(this%arrays) + 1])
      this%arrays = [this%arrays, c_null_ptr]
    end if
    call tell(failure, code)
  end subroutine

  subroutine owner_parameter(this, name, least, most, value, code)
    class(insitu_owner), intent(inout) :: this
    character(*), intent(in) :: name
    real(c_double), intent(in) :: least, most, value
    integer, intent(out), optional :: code
    integer(c_int) :: failure
    failure = c_parameter(this%handle, trim(name) // c_null_char, least, most, value)
    if (failure == 0) this%parameters = this%parameters + 1
    call tell(failure, code)
  end subroutine

  subroutine start(this, code)
    class(insitu_owner), intent(in) :: this
    integer, intent(out), optional :: code
    call tell(c_start(this%handle), code)
  end subroutine

  subroutine begin(this, timeout, waited, code)
    class(insitu_owner), intent(inout) :: this
    real(c_double), intent(in) :: timeout  ! seconds
    real(c_double), intent(out), optional :: waited
    integer, intent(out), optional :: code
    real(c_double) :: seconds
    integer(c_int) :: failure
    seconds = 0
    failure = c_begin(this%handle, timeout, this%arrays, seconds)
    if (present(waited)) waited = seconds
    call tell(failure, code)
  end subroutine

  ! The array of a box, after begin: its bounds are those of add_box.
  subroutine array_float(this, box, array)
    class(insitu_owner), intent(in) :: this
    integer, intent(in) :: box
    real(c_float), pointer, intent(out) :: array(:, :, :)
    real(c_float), pointer :: from_one(:, :, :)
    associate (first => this%first(:, box), last => this%last(:, box))
      call c_f_pointer(this%arrays(box), from_one, last - first + 1)
      array(first(1):, first(2):, first(3):) => from_one
    end associate
  end subroutine

  subroutine array_double(this, box, array)
    class(insitu_owner), intent(in) :: this
    integer, intent(in) :: box
    real(c_double), pointer, intent(out) :: array(:, :, :)
    real(c_double), pointer :: from_one(:, :, :)
    associate (first => this%first(:, box), last => this%last(:, box))
      call c_f_pointer(this%arrays(box), from_one, last - first + 1)
      array(first(1):, first(2):, first(3):) => from_one
    end associate
  end subroutine

  subroutine commit(this, time, simulated, code)
    class(insitu_owner), intent(in) :: this
    integer(c_int64_t), intent(in) :: time
    real(c_double), intent(in) :: simulated
    integer, intent(out), optional :: code
    call tell(c_commit(this%handle, time, simulated), code)
  end subroutine

  ! Copies arrays of the simulation: arrays(i) is c_loc of the first sample of the array of box i.
  subroutine publish(this, time, simulated, arrays, timeout, code)
    class(insitu_owner), intent(in) :: this
    integer(c_int64_t), intent(in) :: time
    real(c_double), intent(in) :: simulated, timeout
    type(c_ptr), intent(in) :: arrays(:)
    integer, intent(out), optional :: code
    call tell(c_publish(this%handle, time, simulated, arrays, c_null_ptr, timeout), code)
  end subroutine

  subroutine poll(this, looked_at, values, code)
    class(insitu_owner), intent(in) :: this
    logical, intent(out), optional :: looked_at
    real(c_double), intent(out), optional :: values(:)  ! as many as parameters
    integer, intent(out), optional :: code
    real(c_double) :: present_values(max(this%parameters, 1))
    integer(c_int) :: looked, failure
    looked = 0
    failure = c_poll(this%handle, looked, present_values)
    if (present(looked_at)) looked_at = looked /= 0
    if (present(values)) values = present_values(:this%parameters)
    call tell(failure, code)
  end subroutine

  subroutine owner_close(this)
    class(insitu_owner), intent(inout) :: this
    call c_close(this%handle)
    this%handle = c_null_ptr
  end subroutine
end module
