/* Kernel: calls the machine code that was compiled for the types of its arguments.
 *
 * Compiled functions take their arguments as they come and would crash on others. Here they are looked at first, by the rules by
 * which numba types values. Where no variant fits, `late` (Python, numba) is called and the miss counted.
 *
 * Types are written one after another:
 *   f  a float (Python's or numpy's float64)      i  an int (Python's or numpy's int64)      b  a bool (Python's or numpy's)
 *   n  None                                       (...)  a tuple of just these
 *   a  an array, with kind and size as in numpy's dtype.str ("f8"), dimensions, layout (C or A: any), and w if it must be writable,
 *      r if it need not be: "af82Cw"
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stddef.h>
#include <structmember.h>
#define NPY_NO_DEPRECATED_API NPY_1_7_API_VERSION
#include <numpy/arrayobject.h>
#include <numpy/arrayscalars.h>

typedef struct {
    PyObject *types;      /* str; `text` is its */
    const char *text;
    PyObject *function;   /* a builtin of METH_VARARGS | METH_KEYWORDS */
} Variant;

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    Py_ssize_t count;
    Variant *variants;
    PyObject *late, *wrapped;
    Py_ssize_t missed;
} Kernel;

static const char *fits(PyObject *value, const char *type);

static const char *array_fits(PyObject *value, const char *type)
{
    if (!PyArray_CheckExact(value))
        return NULL;
    PyArrayObject *array = (PyArrayObject *)value;
    PyArray_Descr *dtype = PyArray_DESCR(array);
    if (dtype->kind != type[1] || dtype->elsize != type[2] - '0' || PyArray_NDIM(array) != type[3] - '0'
        || !PyArray_ISNOTSWAPPED(array) || !PyArray_ISALIGNED(array)
        || (type[4] == 'C' && !PyArray_IS_C_CONTIGUOUS(array)) || (type[5] == 'w' && !PyArray_ISWRITEABLE(array)))
        return NULL;
    return type + 6;
}

static const char *tuple_fits(PyObject *value, const char *type)
{
    if (!PyTuple_CheckExact(value))
        return NULL;
    type++;
    for (Py_ssize_t k = 0; k < PyTuple_GET_SIZE(value); k++) {
        if (*type == ')')
            return NULL;
        type = fits(PyTuple_GET_ITEM(value, k), type);
        if (!type)
            return NULL;
    }
    return *type == ')' ? type + 1 : NULL;
}

/* Returns what follows the type in the text where the value is of it, else NULL. */
static const char *fits(PyObject *value, const char *type)
{
    int right = 0;
    switch (*type) {
    case 'f': right = PyFloat_CheckExact(value) || PyArray_IsScalar(value, Double); break;
    case 'i': right = PyLong_CheckExact(value) || PyArray_IsScalar(value, Long); break;
    case 'b': right = PyBool_Check(value) || PyArray_IsScalar(value, Bool); break;
    case 'n': right = value == Py_None; break;
    case 'a': return array_fits(value, type);
    case '(': return tuple_fits(value, type);
    }
    return right ? type + 1 : NULL;
}

static PyObject *kernel_call(PyObject *object, PyObject *const *arguments, size_t flags, PyObject *names)
{
    Kernel *self = (Kernel *)object;
    Py_ssize_t count = PyVectorcall_NARGS(flags);
    for (Py_ssize_t v = 0; v < self->count && !names; v++) {
        const char *type = self->variants[v].text;
        for (Py_ssize_t k = 0; type && k < count; k++)
            type = *type ? fits(arguments[k], type) : NULL;
        if (!type || *type)
            continue;
        PyObject *packed = PyTuple_New(count);
        if (!packed)
            return NULL;
        for (Py_ssize_t k = 0; k < count; k++) {
            Py_INCREF(arguments[k]);
            PyTuple_SET_ITEM(packed, k, arguments[k]);
        }
        PyObject *result = PyObject_Call(self->variants[v].function, packed, NULL);
        Py_DECREF(packed);
        return result;
    }
    self->missed++;
    return PyObject_Vectorcall(self->late, arguments, flags, names);
}

static void kernel_dealloc(Kernel *self)
{
    for (Py_ssize_t v = 0; v < self->count; v++) {
        Py_XDECREF(self->variants[v].types);
        Py_XDECREF(self->variants[v].function);
    }
    PyMem_Free(self->variants);
    Py_XDECREF(self->late);
    Py_XDECREF(self->wrapped);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyObject *kernel_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    PyObject *variants, *late, *wrapped;
    if (!PyArg_ParseTuple(arguments, "O!OO", &PyList_Type, &variants, &late, &wrapped))
        return NULL;
    Kernel *self = (Kernel *)type->tp_alloc(type, 0);
    if (!self)
        return NULL;
    self->vectorcall = kernel_call;
    Py_INCREF(late);
    self->late = late;
    Py_INCREF(wrapped);
    self->wrapped = wrapped;
    self->variants = PyMem_Calloc(PyList_GET_SIZE(variants) + 1, sizeof(Variant));
    if (!self->variants) {
        Py_DECREF(self);
        return PyErr_NoMemory();
    }
    for (Py_ssize_t v = 0; v < PyList_GET_SIZE(variants); v++) {
        Variant *variant = &self->variants[v];
        if (!PyArg_ParseTuple(PyList_GET_ITEM(variants, v), "UO", &variant->types, &variant->function)) {
            variant->types = variant->function = NULL;
            Py_DECREF(self);
            return NULL;
        }
        Py_INCREF(variant->types);
        Py_INCREF(variant->function);
        self->count = v + 1;
        variant->text = PyUnicode_AsUTF8(variant->types);
        if (!variant->text) {
            Py_DECREF(self);
            return NULL;
        }
    }
    return (PyObject *)self;
}

static PyMemberDef kernel_members[] = {
    {"late", T_OBJECT, offsetof(Kernel, late), READONLY, "Called where no variant fits."},
    {"missed", T_PYSSIZET, offsetof(Kernel, missed), READONLY, "How often no variant fitted."},
    {"__wrapped__", T_OBJECT, offsetof(Kernel, wrapped), READONLY, "The function in Python."},
    {"py_func", T_OBJECT, offsetof(Kernel, wrapped), READONLY, "The function in Python, under numba's name."},
    {NULL}
};

static PyTypeObject KernelType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "_ahead_of_time.Kernel",
    .tp_doc = "Kernel([(types, function), ...], late, wrapped): calls the function compiled for the types of its arguments.",
    .tp_basicsize = sizeof(Kernel),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_vectorcall_offset = offsetof(Kernel, vectorcall),
    .tp_call = PyVectorcall_Call,
    .tp_new = kernel_new,
    .tp_dealloc = (destructor)kernel_dealloc,
    .tp_members = kernel_members,
};

static PyModuleDef module = {PyModuleDef_HEAD_INIT, "_ahead_of_time", "See dispatch.c.", -1, NULL};

PyMODINIT_FUNC PyInit__ahead_of_time(void)
{
    import_array();
    if (PyType_Ready(&KernelType) < 0)
        return NULL;
    PyObject *made = PyModule_Create(&module);
    if (made && PyModule_AddObjectRef(made, "Kernel", (PyObject *)&KernelType) < 0) {
        Py_DECREF(made);
        return NULL;
    }
    return made;
}
