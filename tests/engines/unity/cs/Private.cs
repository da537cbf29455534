// What Unity's editor sets and calls of a component although it is private.

using System;
using System.Reflection;

static class Private
{
    const BindingFlags Own = BindingFlags.Instance | BindingFlags.NonPublic;

    public static void Set(object component, string field, object value)
    {
        component.GetType().GetField(field, Own).SetValue(component, value);
    }

    public static Action Call(object component, string method)
    {
        return (Action)Delegate.CreateDelegate(typeof(Action), component, component.GetType().GetMethod(method, Own));
    }
}
