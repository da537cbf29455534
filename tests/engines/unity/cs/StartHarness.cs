// Runs the script that starts a fire, called Player here, outside of Unity: prints where each of twelve
// begins, of a loop and then of what plays once, and how fast its Animator plays; and the same when it
// begins again.
//
// [RANDOM SPREAD]   its properties

using System;
using System.Globalization;
using System.Threading;
using UnityEngine;

static class Harness
{
    static readonly CultureInfo Plain = CultureInfo.InvariantCulture;

    static void Main(string[] args)
    {
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        foreach (bool loop in new[] { true, false })
        {
            for (int i = 0; i < 12; i++) Begin(loop, args);
        }
    }

    static void Begin(bool loop, string[] args)
    {
        var animator = new Animator { enabled = true, speed = 2 };
        animator.Current = new AnimatorStateInfo { shortNameHash = 7, loop = loop };
        var player = new Player { enabled = true };
        Private.Set(player, "animator", animator);
        if (args.Length > 0) Private.Set(player, "randomStart", bool.Parse(args[0]));
        if (args.Length > 0) Private.Set(player, "speedSpread", float.Parse(args[1], Plain));
        Action enable = Private.Call(player, "OnEnable"), update = Private.Call(player, "Update");
        for (int times = 0; times < 2; times++)
        {
            enable();
            update();
            float begun = animator.Current.normalizedTime;
            update();
            Console.Write("{0} {1} {2} {3} ", Text(begun), Text(animator.Current.normalizedTime), animator.Current.shortNameHash, Text(animator.speed));
            animator.Current.normalizedTime = 0;
        }
        Console.WriteLine();
    }

    static string Text(float number)
    {
        return number.ToString("R", Plain);
    }
}
