// Runs a player of heat, called Player here, outside of Unity and prints what its shader gets.
//
// STATE loop|once flip|plain FRAME,...   then a line a frame on the standard input: the state it is
//                                        of; rect, pivot, size of the page and pixels a unit; channel
//
// It prints the properties of every moment, a line each: name, then four numbers; then the corners of
// the quad and how often the garbage of 20000 further updates had to be collected.

using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Threading;
using UnityEngine;

static class HeatHarness
{
    static readonly CultureInfo Plain = CultureInfo.InvariantCulture;

    static void Main(string[] args)
    {
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        Player.State[] states = States();
        int count = states.First(each => each.name == args[0]).frames.Length;
        var filter = new MeshFilter();
        var quad = new MeshRenderer();
        Component.Siblings = type => type == typeof(MeshFilter) ? (object)filter : quad;
        var animator = new Animator { enabled = true, runtimeAnimatorController = new RuntimeAnimatorController() };
        animator.Current.shortNameHash = Animator.StringToHash(args[0]);
        animator.Current.loop = args[1] == "loop";
        var sprite = new SpriteRenderer { color = new Color(1, 0.5f, 0.25f, 0.75f), flipX = args[2] == "flip", sortingOrder = 7 };
        var player = new Player { enabled = true };
        Private.Set(player, "states", states);
        Private.Set(player, "animator", animator);
        Private.Set(player, "sprite", sprite);
        Private.Call(player, "OnEnable")();
        Action update = Private.Call(player, "LateUpdate");
        foreach (string frame in args[3].Split(','))
        {
            animator.Current.normalizedTime = float.Parse(frame, Plain) / count;
            update();
            foreach (KeyValuePair<int, Vector4> each in quad.Properties.Values.OrderBy(each => each.Key))
                Print(Shader.Names[each.Key], each.Value.x, each.Value.y, each.Value.z, each.Value.w);
            Print("end");
        }
        foreach (Vector3 each in filter.sharedMesh.vertices) Print("corner", each.x, each.y);
        GC.Collect();
        int collections = GC.CollectionCount(0);
        for (int i = 0; i < 20000; i++)
        {
            animator.Current.normalizedTime = i * 0.013f;
            update();
        }
        Print("sorting", quad.sortingOrder);
        Print("collections", GC.CollectionCount(0) - collections);
    }

    static Player.State[] States()
    {
        var frames = new Dictionary<string, List<Player.Frame>>();
        string line;
        while ((line = Console.ReadLine()) != null)
        {
            string[] words = line.Split(' ');
            float[] n = words.Skip(1).Select(word => float.Parse(word, Plain)).ToArray();
            var page = new Texture2D { width = (int)n[6], height = (int)n[7] };
            var shown = new Sprite
            {
                texture = page, rect = new Rect(n[0], n[1], n[2], n[3]), pivot = new Vector2(n[4], n[5]), pixelsPerUnit = n[8]
            };
            if (!frames.ContainsKey(words[0])) frames[words[0]] = new List<Player.Frame>();
            frames[words[0]].Add(new Player.Frame { sprite = shown, channel = (int)n[9] });
        }
        return frames.Select(each => new Player.State { name = each.Key, frames = each.Value.ToArray() }).ToArray();
    }

    static void Print(string name, params float[] numbers)
    {
        Console.WriteLine(string.Join(" ", new[] { name }.Concat(numbers.Select(number => number.ToString("R", Plain)))));
    }
}
